// SPDX-License-Identifier: MIT
// The line bank beside what else does its work, in one run: 21 lines of u and y, in double unless named
// float. Compiled with -march=native for the peers' sake; the library chooses its instructions at run time.
// One item is one sample of both channels. bench/line_bank_ratios.py reads the JSON.
#include <benchmark/benchmark.h>
#include <liquid/liquid.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <complex>
#include <resonid/online/lines/detail/line_bank_block.hpp>
#include <resonid/online/lines/line_bank.hpp>
#include <span>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::size_t kSamples = 4096;
constexpr std::size_t kBenchLines = 21;

struct Signals {
  std::vector<double> frequency_hz;
  std::vector<double> u = std::vector<double>(kSamples), y = std::vector<double>(kSamples);
  Signals() {
    for (std::size_t i = 0; i < kBenchLines; ++i) frequency_hz.push_back(20.0 + 5.0 * static_cast<double>(i));
    for (std::size_t k = 0; k < kSamples; ++k) {
      const double t = static_cast<double>(k) / 2000.0;
      for (std::size_t i = 0; i < kBenchLines; ++i) {
        const double angle = 6.283185307179586 * frequency_hz[i] * t + 0.3 * static_cast<double>(i * i);
        u[k] += std::cos(angle);
        y[k] += std::sin(angle + 0.2) / static_cast<double>(i + 1);
      }
    }
  }
};
const Signals& signals() {
  static const Signals made;
  return made;
}

template <class Real>
LineBank<Real, kBenchLines> make() {
  LineBankConfig config;
  config.bank.sample_rate_hz = 2000.0;
  config.bank.frequency_hz = signals().frequency_hz;
  config.known_delay_s = 0.001;
  return LineBank<Real, kBenchLines>::create(config).value();
}
template <class Real>
struct Inputs {
  std::vector<Real> u{signals().u.begin(), signals().u.end()}, y{signals().y.begin(), signals().y.end()};
};

void count_items(benchmark::State& state) {
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}

/// The bank, and what its responses are written to, at `Offset` bytes behind a multiple of 64.
template <class Real, std::size_t Offset = 0>
struct Place {
  alignas(64) std::array<std::byte, sizeof(LineBank<Real, kBenchLines>) + 64> memory;
  LineBank<Real, kBenchLines>& bank =
      *::new (static_cast<void*>(memory.data() + Offset)) LineBank<Real, kBenchLines>(make<Real>());
  alignas(64) std::array<Real, 24 + Offset> re_room{};
  alignas(64) std::array<Real, 24 + Offset> im_room{};
  std::span<Real> re{re_room.data() + Offset / sizeof(Real), kBenchLines};
  std::span<Real> im{im_room.data() + Offset / sizeof(Real), kBenchLines};
};

template <class Real, std::size_t Offset>
void per_call(benchmark::State& state) {
  Place<Real, Offset> place;
  const Inputs<Real> in;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      place.bank.step({in.u[k], in.y[k]}, place.re, place.im);
      benchmark::ClobberMemory();
    }
    benchmark::DoNotOptimize(place.re);
  }
  count_items(state);
}
BENCHMARK(per_call<double, 0>)->Name("resonid/per_call/responses_every_sample");
BENCHMARK(per_call<double, 16>)->Name("resonid/per_call/responses_every_sample/misaligned");
BENCHMARK(per_call<float, 0>)->Name("resonid/per_call/responses_every_sample/float");

void two_calls(benchmark::State& state) {
  Place<double> place;
  const Inputs<double> in;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      place.bank.step(in.u[k], in.y[k]);
      place.bank.responses(place.re, place.im);
      benchmark::ClobberMemory();
    }
    benchmark::DoNotOptimize(place.re);
  }
  count_items(state);
}
BENCHMARK(two_calls)->Name("resonid/per_call/step_then_responses");

void step_only(benchmark::State& state) {
  Place<double> place;
  const Inputs<double> in;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) place.bank.step(in.u[k], in.y[k]);
    benchmark::DoNotOptimize(place.bank);
  }
  count_items(state);
}
BENCHMARK(step_only)->Name("resonid/per_call/no_responses");

template <class Real>
void scalar_path(benchmark::State& state) {
  Oscillators<Real, kBenchLines, 2> bank;
  LineBankConfig config;
  config.bank.sample_rate_hz = 2000.0;
  std::array<double, kBenchLines> angle{};
  for (std::size_t i = 0; i < kBenchLines; ++i) angle[i] = kTwoPi * signals().frequency_hz[i] / 2000.0;
  bank.configure(angle, bank_gain<kBenchLines>(angle, config.bank));
  const Inputs<Real> in;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) bank.step_or_predict({in.u[k], in.y[k]});
    benchmark::DoNotOptimize(bank);
  }
  count_items(state);
}
BENCHMARK(scalar_path<double>)->Name("resonid/per_call/no_responses/without_highway");

template <class Real>
void batch(benchmark::State& state) {
  Place<Real> place;
  const LineBankBlock<Real, kBenchLines> block(place.bank);
  const Inputs<Real> in;
  const auto stride = static_cast<std::size_t>(state.range(0));
  constexpr std::size_t kBatch = 256;  // responses of a batch stay in the second cache
  constexpr std::size_t kRow = 24;     // whole cache lines
  alignas(64) static std::array<Real, kBatch * kRow> re, im;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; k += kBatch)
      block.run(place.bank, {std::span(in.u).subspan(k, kBatch), std::span(in.y).subspan(k, kBatch)}, stride,
                re, im, kRow);
    benchmark::ClobberMemory();
  }
  count_items(state);
}
BENCHMARK(batch<double>)->Name("resonid/batch/responses_every")->Arg(1)->Arg(16)->Arg(256);
BENCHMARK(batch<float>)->Name("resonid/batch/float/responses_every")->Arg(1)->Arg(16);

/// The printed matrices as they stand: x <- A x + K e, e = z - H x, 2 n + 1 states. `Columns` 2: both
/// channels as the columns of one state matrix; 1: two filters one after the other.
template <int Columns>
void eigen_dense(benchmark::State& state) {
  constexpr int kStates = 2 * static_cast<int>(kBenchLines) + 1;
  using Square = Eigen::Matrix<double, kStates, kStates>;
  using States = Eigen::Matrix<double, kStates, Columns>;
  using Row = Eigen::Matrix<double, 1, kStates>;
  Square a = Square::Zero();
  Row h = Row::Zero();
  Eigen::Matrix<double, kStates, 1> gain;
  for (std::size_t i = 0; i < kBenchLines; ++i) {
    const double w = kTwoPi * signals().frequency_hz[i] / 2000.0;
    const int j = 2 * static_cast<int>(i);
    a.block<2, 2>(j, j) << std::cos(w), std::sin(w), -std::sin(w), std::cos(w);
    h(j) = 1.0;
  }
  a(kStates - 1, kStates - 1) = h(kStates - 1) = 1.0;
  gain = a * h.transpose() / (h * h.transpose() + 100.0);
  std::array<States, 2 / Columns> x;
  for (auto& channel : x) channel.setZero();
  const Inputs<double> in;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      for (std::size_t c = 0; c < x.size(); ++c) {
        Eigen::Matrix<double, 1, Columns> e;
        e(0) = c == 0 ? in.u[k] : in.y[k];
        if constexpr (Columns == 2) e(1) = in.y[k];
        e -= h * x[c];
        States next;
        next.noalias() = a * x[c];
        next.noalias() += gain * e;
        x[c] = next;
      }
    }
    benchmark::DoNotOptimize(x);
  }
  count_items(state);
}
BENCHMARK(eigen_dense<1>)->Name("eigen_dense/two_filters");
BENCHMARK(eigen_dense<2>)->Name("eigen_dense/two_columns");

/// One second-order section per line and channel (in float, as liquid has them), all fed with the channel's
/// innovation: Re p(k+1) = (g_re - (g_re cos w + g_im sin w) z^-1)/(1 - 2 cos w z^-1 + z^-2) e.
struct LiquidBank {
  std::array<iirfilt_rrrf, kBenchLines> section{};
  float predicted = 0.0F;
  LiquidBank() {
    for (std::size_t i = 0; i < kBenchLines; ++i) {
      const double w = kTwoPi * signals().frequency_hz[i] / 2000.0;
      const std::complex<double> gain = std::polar(1.0 / (kBenchLines + 1.0 + 100.0), w);
      float b[3] = {static_cast<float>(gain.real()),
                    static_cast<float>(-(gain.real() * std::cos(w) + gain.imag() * std::sin(w))), 0.0F};
      float a[3] = {1.0F, static_cast<float>(-2.0 * std::cos(w)), 1.0F};
      section[i] = iirfilt_rrrf_create(b, 3, a, 3);
    }
  }
  LiquidBank(const LiquidBank&) = delete;
  LiquidBank& operator=(const LiquidBank&) = delete;
  ~LiquidBank() {
    for (auto filter : section) iirfilt_rrrf_destroy(filter);
  }
  void step(float z) {
    const float e = z - predicted;
    predicted = 0.0F;
    for (auto filter : section) {
      float y = 0.0F;
      iirfilt_rrrf_execute(filter, e, &y);
      predicted += y;
    }
  }
};

void liquid_biquads(benchmark::State& state) {
  LiquidBank u, y;
  const Inputs<float> in;
  for (auto _ : state) {
    for (std::size_t k = 0; k < kSamples; ++k) {
      u.step(in.u[k]);
      y.step(in.y[k]);
    }
    benchmark::DoNotOptimize(u.predicted);
    benchmark::DoNotOptimize(y.predicted);
  }
  count_items(state);
}
BENCHMARK(liquid_biquads)->Name("liquid_biquads");

/// Peak of fused multiply-adds in double with the widest vectors: the yardstick of the flop bound.
#if defined(__AVX512F__)
using Wide [[gnu::vector_size(64)]] = double;
#else
using Wide [[gnu::vector_size(32)]] = double;
#endif
void fma_peak(benchmark::State& state) {
  constexpr std::size_t kChains = 12;  // latency 4, two units: 8 would do
  constexpr std::size_t kRounds = 1024;
  std::array<Wide, kChains> x{};
  Wide a = x[0] + 0.999999, b = x[0] + 1e-6;
  benchmark::DoNotOptimize(a);
  benchmark::DoNotOptimize(b);
  for (auto _ : state) {
    Wide x0 = x[0], x1 = x[1], x2 = x[2], x3 = x[3], x4 = x[4], x5 = x[5], x6 = x[6], x7 = x[7], x8 = x[8],
         x9 = x[9], x10 = x[10], x11 = x[11];
    for (std::size_t k = 0; k < kRounds; ++k) {
      x0 = x0 * a + b, x1 = x1 * a + b, x2 = x2 * a + b, x3 = x3 * a + b, x4 = x4 * a + b, x5 = x5 * a + b;
      x6 = x6 * a + b, x7 = x7 * a + b, x8 = x8 * a + b, x9 = x9 * a + b, x10 = x10 * a + b,
      x11 = x11 * a + b;
    }
    x = {x0, x1, x2, x3, x4, x5, x6, x7, x8, x9, x10, x11};
    benchmark::DoNotOptimize(x);
  }
  state.counters["flops"] = benchmark::Counter(
      static_cast<double>(state.iterations()) * 2.0 * kChains * kRounds * (sizeof(Wide) / sizeof(double)),
      benchmark::Counter::kIsRate);
}
BENCHMARK(fma_peak)->Name("fma_peak");

}  // namespace
}  // namespace resonid::online
