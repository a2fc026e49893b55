// SPDX-License-Identifier: MIT
// What tools/count_instructions runs under callgrind: each estimator over the same number of samples of
// several kinds of data; callgrind writes one file of counts per pair.
#include <valgrind/callgrind.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <memory>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <resonid/online/models/closed_loop_output_error.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/models/rls.hpp>
#include <string>
#include <vector>

namespace {

constexpr std::size_t kSamples = 2048;
constexpr double kRateHz = 500.0;

struct Sample {
  double ru, u, y;
};
using Signal = std::vector<Sample>;

double uniform(std::uint64_t& state) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
}

/// A first-order machine under noise.
Signal noise() {
  Signal s;
  std::uint64_t state = 88172645463325252ULL;
  double y = 0.0;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const double ru = uniform(state);
    y = 0.9 * y + 0.1 * ru + 0.01 * uniform(state);
    s.push_back({ru, ru - 0.2 * y, y});
  }
  return s;
}
Signal of(double value) { return Signal(kSamples, Sample{value, value, value}); }

template <class Step>
[[gnu::noipa]] void measured(Step& step, const Signal& signal) {
  for (const Sample& s : signal) step(s);
}

/// Counts one step per sample, and writes the file `name/kind`.
template <class Step>
void count_one(const std::string& name, const std::string& kind, const Step& start, const Signal& signal) {
  Step step = start;
  const std::string label = name + "/" + kind;
  measured(step, signal);  // the first call chooses kernels and binds symbols
  CALLGRIND_ZERO_STATS;
  measured(step, signal);
  CALLGRIND_DUMP_STATS_AT(label.c_str());
}
template <class Step>
void count(const std::string& name, const Step& step) {
  count_one(name, "noise", step, noise());
  count_one(name, "zeros", step, of(0.0));
  count_one(name, "denormal", step, of(std::numeric_limits<double>::denorm_min()));
  count_one(name, "nan", step, of(std::numeric_limits<double>::quiet_NaN()));
}

std::vector<double> lines_hz(std::size_t count) {
  std::vector<double> f;
  for (std::size_t i = 0; i < count; ++i) f.push_back(5.0 * static_cast<double>(i + 1));
  return f;
}

void count_trackers() {
  using namespace resonid::online;
  for (const std::size_t n : {8U, 21U}) {
    const auto f = lines_hz(n);
    LineBankConfig config;
    config.bank = {.sample_rate_hz = kRateHz, .frequency_hz = f};
    const std::string name = "line_bank_" + std::to_string(n);
    std::array<double, 24> re{}, im{};
    auto bank = LineBank<double, 21>::create(config).value();
    count(name + "_u_y_responses", [bank, re, im](const Sample& s) mutable {
      bank.step({s.u, s.y}, re, im);
    });
    auto narrow = LineBank<float, 21>::create(config).value();
    std::array<float, 24> narrow_re{}, narrow_im{};
    count(name + "_u_y_responses_float", [narrow, narrow_re, narrow_im](const Sample& s) mutable {
      narrow.step({static_cast<float>(s.u), static_cast<float>(s.y)}, narrow_re, narrow_im);
    });
  }
  const auto f = lines_hz(21);
  auto bank = KalmanBank<double, 21>::create({.sample_rate_hz = kRateHz, .frequency_hz = f}).value();
  count("kalman_bank_21", [bank](const Sample& s) mutable { bank.step(s.y); });
  auto responses = ResponseTracker<KalmanBank<double, 21>>::create(bank, {}).value();
  count("response_tracker_kalman_bank_21",
        [responses](const Sample& s) mutable { responses.step(s.ru, s.u, s.y); });
  auto chirp = ChirpTracker<double>::create(
                   {.sample_rate_hz = kRateHz, .from_hz = 35.0, .to_hz = 1.5, .duration_s = 17.0})
                   .value();
  count("chirp_tracker_ru_u_y", [ru = chirp, u = chirp, y = chirp](const Sample& s) mutable {
    ru.step(s.ru);
    u.step(s.u);
    y.step(s.y);
  });
  auto dft = SlidingDft<double, 21, 200>::create(
                 {.sample_rate_hz = kRateHz, .window_samples = 200, .frequency_hz = f})
                 .value();
  count("sliding_dft_21", [dft](const Sample& s) mutable { dft.step(s.y); });
}

void count_recursions() {
  using namespace resonid::online;
  auto rls = RecursiveLeastSquares<double, 6>::create({}).value();
  std::array<double, 6> past{};
  count("rls_6", [rls, past](const Sample& s) mutable {
    rls.step(past, s.y);
    past = {s.u, past[0], past[1], -s.y, past[3], past[4]};
  });
  static constexpr std::array<double, 3> kB{1.117, -0.646, 1.005}, kA{-0.835, 0.682, -0.847};
  static constexpr std::array<double, 3> kNumerator{0.124848, -0.2448, 0.12}, kDenominator{1.0, -2.0, 1.0};
  ClosedLoopOutputErrorConfig config;
  config.common.sample_rate_hz = 250.0;
  config.common.delay_samples = 1;
  config.common.start_b = kB;
  config.common.start_a = kA;
  config.common.adaptation.start_variance = 0.01;
  config.controller_numerator = kNumerator;
  config.controller_denominator = kDenominator;
  auto cloe = ClosedLoopOutputError<double, 3>::create(config).value();
  count("cloe_3", [cloe](const Sample& s) mutable { cloe.step(s.ru, s.u, s.y); });
  PhysicalTrackerConfig drive;
  drive.sample_rate_hz = kRateHz;
  drive.driven_inertia.value = 0.036;
  drive.load_inertia.value = 0.028;
  drive.stiffness.value = 160.0;
  drive.damping.value = 0.25;
  auto tracker = PhysicalTracker<double, 0>::create(drive).value();
  count("physical_tracker", [tracker](const Sample& s) mutable { tracker.step(0.0, s.u, s.y); });
}

}  // namespace

int main() {
  std::printf("samples %zu\ncompiler %s\nflags %s\n", kSamples, __VERSION__, RESONID_COUNT_FLAGS);
  count_trackers();
  count_recursions();
  return RUNNING_ON_VALGRIND != 0 ? 0 : 1;
}
