// SPDX-License-Identifier: MIT
#include <benchmark/benchmark.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/online/lines/sliding_dft.hpp>
#include <vector>

namespace resonid::online {
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

/// The least that a modulated sliding DFT of 21 bins needs: one sum per bin, which drifts, and a factor of
/// every bin for every sample of the window.
template <class Scalar>
void plain_sliding_dft(benchmark::State& state) {
  constexpr std::size_t kWindow = 400, kBins = 21;
  std::vector<Scalar> cosine(kWindow * kBins), sine(kWindow * kBins), history(kWindow);
  for (std::size_t m = 0; m < kWindow; ++m)
    for (std::size_t b = 0; b < kBins; ++b) {
      const double angle = kTwoPi * static_cast<double>((4 + b) * m % kWindow) / double(kWindow);
      cosine[m * kBins + b] = static_cast<Scalar>(std::cos(angle));
      sine[m * kBins + b] = static_cast<Scalar>(-std::sin(angle));
    }
  std::array<Scalar, kBins> re{}, im{};
  const auto x = signal();
  std::size_t m = 0;
  for (auto _ : state)
    for (const double sample : x) {
      const Scalar change = static_cast<Scalar>(sample) - history[m];
      history[m] = static_cast<Scalar>(sample);
      for (std::size_t b = 0; b < kBins; ++b) {
        re[b] += change * cosine[m * kBins + b];
        im[b] += change * sine[m * kBins + b];
      }
      if (++m == kWindow) m = 0;
      benchmark::DoNotOptimize(re);
      benchmark::DoNotOptimize(im);
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(plain_sliding_dft<double>);
BENCHMARK(plain_sliding_dft<float>);

/// The same with a matrix library's fixed-size arrays.
template <class Scalar>
void eigen_sliding_dft(benchmark::State& state) {
  constexpr int kWindow = 400, kBins = 21;
  using Row = Eigen::Array<Scalar, kBins, 1>;
  Eigen::Array<Scalar, kBins, Eigen::Dynamic> cosine(kBins, kWindow), sine(kBins, kWindow);
  for (int m = 0; m < kWindow; ++m)
    for (int b = 0; b < kBins; ++b) {
      const double angle = kTwoPi * static_cast<double>((4 + b) * m % kWindow) / double(kWindow);
      cosine(b, m) = static_cast<Scalar>(std::cos(angle));
      sine(b, m) = static_cast<Scalar>(-std::sin(angle));
    }
  Row re = Row::Zero(), im = Row::Zero();
  std::vector<Scalar> history(kWindow);
  const auto x = signal();
  int m = 0;
  for (auto _ : state)
    for (const double sample : x) {
      auto& oldest = history[static_cast<std::size_t>(m)];
      const Scalar change = static_cast<Scalar>(sample) - oldest;
      oldest = static_cast<Scalar>(sample);
      re += change * cosine.col(m);
      im += change * sine.col(m);
      if (++m == kWindow) m = 0;
      benchmark::DoNotOptimize(re);
      benchmark::DoNotOptimize(im);
    }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(eigen_sliding_dft<double>);
BENCHMARK(eigen_sliding_dft<float>);

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

/// ru, u and y at once.
void chirp_tracker_of_three(benchmark::State& state) {
  ChirpTrackerConfig config;
  config.sample_rate_hz = 500.0;
  config.from_hz = 35.0;
  config.to_hz = 1.5;
  config.duration_s = 17.0;
  config.lambda = 8.0;
  auto tracker = ChirpTracker<double, 3>::create(config).value();
  const auto x = signal();
  for (auto _ : state) {
    for (const double sample : x) tracker.step({sample, 0.9 * sample, 0.5 * sample});
    benchmark::DoNotOptimize(tracker);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}
BENCHMARK(chirp_tracker_of_three);

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
}  // namespace resonid::online
