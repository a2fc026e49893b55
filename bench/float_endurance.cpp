// SPDX-License-Identifier: MIT
// A thousand million samples of known signals through the trackers in single precision: relative error early
// and late. A minute or two; usage: endurance_float [SAMPLES]. Exit code 1 when an error is beyond 1e-4.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <float_endurance.hpp>

namespace {

bool report(const char* name, std::uint64_t samples,
            resonid::test::Endurance (*endurance)(std::uint64_t samples)) {
  const auto start = std::chrono::steady_clock::now();
  const auto error = endurance(samples);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::printf("%-22s %12llu samples   early %.2e   late %.2e   %6.1f s\n", name,
              static_cast<unsigned long long>(samples), error.early, error.late, took.count());
  std::fflush(stdout);
  return error.late < 1e-4;
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t samples = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1000000000ULL;
  bool good = report("LineBank<float, 8>", samples, resonid::test::line_bank_endurance);
  good = report("ChirpTracker<float>", samples, resonid::test::chirp_tracker_endurance) && good;
  good = report("SlidingDft<float, 8>", samples, resonid::test::sliding_dft_endurance) && good;
  return good ? EXIT_SUCCESS : EXIT_FAILURE;
}
