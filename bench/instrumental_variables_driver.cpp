// SPDX-License-Identifier: MIT
// One update of refined instrumental variables beside the least squares of six parameters in the same run;
// and, by name (--benchmark_filter=endurance), a thousand million updates with the excitation off half of the
// time, whose counters must say that everything stayed finite and that the estimate was frozen.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/rls.hpp>

namespace resonid::online {
namespace {

constexpr std::array<double, 3> kNumerator{0.124848, -0.2448, 0.12}, kDenominator{1.0, -2.0, 1.0};

double uniform(std::uint64_t& state) {
  state ^= state << 13;
  state ^= state >> 7;
  state ^= state << 17;
  return static_cast<double>(state >> 11) * 0x1p-53 - 0.5;
}

/// The tooth belt at 4 ms under its controller with a random binary excitation and noise.
struct Loop {
  DiscreteModel<double, 3> model{{1.060621, -0.276507, 0.936151}, {-0.485041, 0.315348, -0.830307}};
  AuxiliaryLoop<double, 3> machine = AuxiliaryLoop<double, 3>::create(kNumerator, kDenominator, 1).value();
  std::uint64_t state = 88172645463325252ULL;
  double ru = 0.0, u = 0.0, y = 0.0;

  Loop() { machine.set_model(model); }
  void step(bool excited) {
    ru = !excited ? 0.0 : uniform(state) > 0.0 ? 1.0 : -1.0;
    machine.step(ru);
    u = machine.input().at(0);
    y = machine.output().at(0) + 0.2 * uniform(state);
  }
};

constexpr std::size_t kSamples = 4096;
struct Signals {
  std::array<double, kSamples> ru{}, u{}, y{};
  Signals() {
    Loop loop;
    for (std::size_t k = 0; k < kSamples; ++k) {
      loop.step(true);
      ru[k] = loop.ru;
      u[k] = loop.u;
      y[k] = loop.y;
    }
  }
};

void least_squares_of_six(benchmark::State& state) {
  static const Signals s;
  auto rls = RecursiveLeastSquares<double, 6>::create({}).value();
  std::array<double, 6> f{};
  std::size_t k = 0;
  for (auto _ : state) {
    rls.step(f, s.y[k]);
    f = {s.u[k], f[0], f[1], -s.y[k], f[3], f[4]};
    k = (k + 1) % kSamples;
  }
  benchmark::DoNotOptimize(rls.parameters());
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(least_squares_of_six);

template <class Real>
void refined(benchmark::State& state) {
  static const Signals s;
  InstrumentalVariablesConfig<3> config;
  config.start = Loop().model;
  config.controller_numerator = kNumerator;
  config.controller_denominator = kDenominator;
  config.delay_samples = 1;
  config.extrapolate = state.range(0) != 0;
  auto iv = InstrumentalVariables<Real, 3>::create(config).value();
  std::size_t k = 0;
  for (auto _ : state) {
    iv.step(static_cast<Real>(s.ru[k]), static_cast<Real>(s.u[k]), static_cast<Real>(s.y[k]));
    k = (k + 1) % kSamples;
  }
  benchmark::DoNotOptimize(iv.model());
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK_TEMPLATE(refined, double)->ArgName("extrapolated")->Arg(0)->Arg(1);
BENCHMARK_TEMPLATE(refined, float)->ArgName("extrapolated")->Arg(0);

void endurance(benchmark::State& state) {
  constexpr std::uint64_t kPhase = 50'000;
  Loop loop;
  InstrumentalVariablesConfig<3> config;
  config.start = loop.model;
  config.controller_numerator = kNumerator;
  config.controller_denominator = kDenominator;
  config.delay_samples = 1;
  auto iv = InstrumentalVariables<double, 3>::create(config).value();
  const double truth = SampledModes<3>(loop.model, 250.0).resonances()[0].frequency_hz;
  double worst = 0.0, wrong_flags = 0.0, broken = 0.0;
  std::uint64_t k = 0;
  for (auto _ : state) {
    const bool excited = k / kPhase % 2 == 0;
    loop.step(excited);
    iv.step(loop.ru, loop.u, loop.y);
    if (++k % kPhase != 0) continue;
    const auto modes = SampledModes<3>(iv.model(), 250.0).resonances();
    worst = modes.empty() ? std::numeric_limits<double>::infinity()
                          : std::max(worst, std::abs(modes[0].frequency_hz / truth - 1.0));
    wrong_flags += iv.excited() != excited ? 1.0 : 0.0;
    broken += iv.covariance().allFinite() ? 0.0 : 1.0;
  }
  state.counters["worst_resonance_error"] = worst;
  state.counters["wrong_flags"] = wrong_flags;
  state.counters["not_finite"] = broken;
  state.SetItemsProcessed(state.iterations());
}
BENCHMARK(endurance)->Iterations(1'000'000'000)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace resonid::online
