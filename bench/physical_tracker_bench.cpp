// SPDX-License-Identifier: MIT
// The physical tracker beside recursive least squares of six parameters, whose time is the unit of its budget
// (at most 40 times).
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/models/rls.hpp>
#include <vector>

namespace resonid::online {
namespace {

constexpr std::size_t kSamples = 8192;

struct Signals {
  std::vector<double> u, y;
};

/// A belt drive under pseudo-random torque, noise left away: the work does not depend on it.
Signals signals() {
  const TwoMassPoint<double> belt{0.032, 0.032, 143.75, 0.3, 0.0};
  const auto zoh = ZohTwoMass<double>::over(belt, 94.8, 0.002);
  Signals s;
  std::array<double, 3> x{};
  std::uint32_t bits = 1;
  for (std::size_t k = 0; k < kSamples; ++k) {
    bits = (bits >> 1) ^ ((bits & 1U) != 0 ? 0xB400U : 0U);
    const double u = ((bits & 1U) != 0 ? 1.0 : -1.0) - 0.05 * x[0];
    s.u.push_back(u);
    s.y.push_back(x[0] + 0.1 * std::sin(1e3 * static_cast<double>(bits)));
    std::array<double, 3> next{};
    for (std::size_t i = 0; i < 3; ++i)
      next[i] = zoh.ab[i][0] * x[0] + zoh.ab[i][1] * x[1] + zoh.ab[i][2] * x[2] + zoh.ab[i][3] * u;
    x = next;
  }
  return s;
}

void rls_of_six(benchmark::State& state) {
  auto rls = RecursiveLeastSquares<double, 6>::create({.factor = 0.999}).value();
  const auto s = signals();
  for (auto _ : state) {
    for (std::size_t k = 3; k < kSamples; ++k)
      rls.step({s.u[k - 1], s.u[k - 2], s.u[k - 3], -s.y[k - 1], -s.y[k - 2], -s.y[k - 3]}, s.y[k]);
    benchmark::DoNotOptimize(rls);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples - 3));
}
BENCHMARK(rls_of_six);

PhysicalTrackerConfig drive() {
  PhysicalTrackerConfig c;
  c.sample_rate_hz = 500.0;
  c.driven_inertia.value = 0.036;
  c.load_inertia.value = 0.028;
  c.stiffness.value = 160.0;
  c.damping.value = 0.25;
  return c;
}

template <std::size_t Replay>
void track(benchmark::State& state, const PhysicalTrackerConfig& config, bool again) {
  using Tracker = PhysicalTracker<double, Replay>;
  const auto tracker = std::make_unique<Tracker>(Tracker::create(config).value());
  const auto s = signals();
  for (auto _ : state) {
    if (again) tracker->reset();
    for (std::size_t k = 0; k < kSamples; ++k) tracker->step(0.0, s.u[k], s.y[k]);
    benchmark::DoNotOptimize(*tracker);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(kSamples));
}

/// A machine that stays, once the start has been gone over.
void constant_machine(benchmark::State& state) { track<0>(state, drive(), false); }
BENCHMARK(constant_machine);

/// The first 8192 samples, with the start gone over again and again beside them.
void constant_machine_start(benchmark::State& state) { track<16384>(state, drive(), true); }
BENCHMARK(constant_machine_start);

void moving_machine(benchmark::State& state) {
  auto config = drive();
  config.stiffness_drift_per_s = 0.1;
  track<0>(state, config, false);
}
BENCHMARK(moving_machine);

}  // namespace
}  // namespace resonid::online
