// SPDX-License-Identifier: MIT
// Output-error and Sanathanan-Koerner fits; bench/fit_against_scipy.py runs the same work by scipy beside it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <cstdint>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/detail/sanathanan_koerner.hpp>
#include <resonid/response/welch.hpp>

namespace {

using namespace resonid;

/// The pole pair of a resonance and a slow pole; the same numbers stand in fit_against_scipy.py.
data::TransferFunction model(double radius, double angle, double pole) {
  const double a1 = -2.0 * radius * std::cos(angle), a2 = radius * radius;
  return {{0.0, 0.06, -0.11, 0.056}, {1.0, a1 - pole, a2 - pole * a1, -pole * a2}, 0.002};
}

data::Record record() {
  std::uint64_t state = 1;
  const auto uniform = [&state] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) * 0x1p-53;
  };
  data::Record r;
  r.sample_rate_hz = 500.0;
  for (int k = 0; k < 10000; ++k) r.input.samples.push_back(uniform() > 0.5 ? 1.0 : -1.0);
  r.output.samples = model(0.985, 0.19, 0.995).simulate(r.input.samples);
  for (double& v : r.output.samples) v += 0.1 * std::sqrt(12.0) * (uniform() - 0.5);
  return r;
}

void output_error(benchmark::State& state, bool given_start) {
  const auto r = record();
  fit::BlackBoxConfig config;
  config.initial_state = config.offset = config.noise_model = false;
  if (given_start) config.initial = model(0.975, 0.2, 0.98);
  for (auto _ : state) benchmark::DoNotOptimize(fit::fit_black_box(r, config));
}
void output_error_from_start(benchmark::State& state) { output_error(state, true); }
void output_error_from_scratch(benchmark::State& state) { output_error(state, false); }
BENCHMARK(output_error_from_start)->Unit(benchmark::kMicrosecond);
BENCHMARK(output_error_from_scratch)->Unit(benchmark::kMicrosecond);

void sanathanan_koerner_100_points(benchmark::State& state) {
  const auto truth = model(0.985, 0.19, 0.995);
  data::FrequencyResponse g;
  for (int i = 1; i <= 100; ++i) {
    g.frequency_hz.push_back(i);
    g.value.push_back(truth.response(i) * (1.0 + 0.01 * std::sin(i)));
  }
  fit::SanathananKoernerConfig config;
  config.sample_time_s = 0.002;
  config.iterations = 10;
  for (auto _ : state) benchmark::DoNotOptimize(fit::fit_sanathanan_koerner(g, config));
}
BENCHMARK(sanathanan_koerner_100_points)->Unit(benchmark::kMicrosecond);

void welch_two_million_samples(benchmark::State& state) {
  auto r = record();
  std::vector<double> u, y;
  double filtered = 0.0;
  std::uint64_t seed = 7;
  for (int k = 0; k < 2000000; ++k) {
    seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
    u.push_back(static_cast<double>(seed >> 11) * 0x1p-53 - 0.5);
    filtered = 0.95 * filtered + 0.1 * u.back();
    y.push_back(filtered);
  }
  r.input.samples = std::move(u);
  r.output.samples = std::move(y);
  response::WelchConfig config;
  config.segment_samples = 4096;
  response::ResponseOptions options;
  options.approach = Approach::direct;
  for (auto _ : state) benchmark::DoNotOptimize(response::welch(r, config, options));
}
BENCHMARK(welch_two_million_samples)->Unit(benchmark::kMicrosecond);

}  // namespace
