// SPDX-License-Identifier: MIT
#include <benchmark/benchmark.h>

#include <cmath>
#include <resonid/tracking/chirp_tracker.hpp>
#include <resonid/tracking/kalman_bank.hpp>
#include <resonid/tracking/response_tracker.hpp>
#include <resonid/tracking/sliding_dft.hpp>
#include <vector>

namespace resonid::tracking {
namespace {

constexpr std::size_t kSamples = 4096;

std::vector<double> signal() {
  std::vector<double> x(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k) x[k] = std::sin(0.05 * static_cast<double>(k));
  return x;
}

std::vector<double> lines(std::int64_t count) {
  std::vector<double> f;
  for (std::int64_t i = 0; i < count; ++i) f.push_back(20.0 + 5.0 * static_cast<double>(i));
  return f;
}

/// Runs a tracker over the signal; the figure to read is time per item, one item being one sample.
template <class Tracker>
void run(benchmark::State& state, Tracker tracker) {
  using Scalar = typename Tracker::Scalar;
  const auto x = signal();
  for (auto _ : state) {
    for (const double sample : x) tracker.step(static_cast<Scalar>(sample));
    benchmark::DoNotOptimize(tracker);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}

template <class Scalar>
void kalman_bank(benchmark::State& state) {
  KalmanBankConfig config;
  const auto f = lines(state.range(0));
  config.sample_rate_hz = 2000.0;
  config.frequency_hz = f;
  config.lambda = 100.0;
  run(state, KalmanBank<Scalar, 32>::create(config).value());
}
BENCHMARK(kalman_bank<double>)->Arg(8)->Arg(21);
BENCHMARK(kalman_bank<float>)->Arg(8)->Arg(21);

template <class Scalar>
void sliding_dft(benchmark::State& state) {
  SlidingDftConfig config;
  const auto f = lines(state.range(0));
  config.sample_rate_hz = 2000.0;
  config.frequency_hz = f;
  config.window_samples = 400;
  run(state, SlidingDft<Scalar, 32, 400>::create(config).value());
}
BENCHMARK(sliding_dft<double>)->Arg(8)->Arg(21);
BENCHMARK(sliding_dft<float>)->Arg(8)->Arg(21);

void chirp_tracker(benchmark::State& state) {
  ChirpTrackerConfig config;
  config.sample_rate_hz = 500.0;
  config.from_hz = 35.0;
  config.to_hz = 1.5;
  config.duration_s = 17.0;
  config.lambda = 8.0;
  run(state, ChirpTracker<double>::create(config).value());
}
BENCHMARK(chirp_tracker);

/// Response at all lines from excitation, input and output, standard deviation included.
void response_tracker(benchmark::State& state) {
  KalmanBankConfig config;
  const auto f = lines(state.range(0));
  config.sample_rate_hz = 2000.0;
  config.frequency_hz = f;
  config.lambda = 100.0;
  const auto bank = KalmanBank<double, 32>::create(config).value();
  auto tracker = ResponseTracker<KalmanBank<double, 32>>::create(bank, {}).value();
  const auto x = signal();
  for (auto _ : state) {
    for (const double sample : x) tracker.step(sample, 0.9 * sample, 0.5 * sample);
    benchmark::DoNotOptimize(tracker);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(response_tracker)->Arg(8)->Arg(21);

}  // namespace
}  // namespace resonid::tracking
