// SPDX-License-Identifier: MIT
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "design/loop_survey.hpp"
#include "design/robust.hpp"

namespace resonid::design {
namespace {

/// Two masses, 500 Hz, 4 ms of delay: system 2 of the golden files, or one with five times the load.
fit::DriveModel drive(double driven_inertia, double load_inertia, double stiffness, double damping) {
  fit::DriveModel m;
  m.sample_time_s = 0.002;
  m.known_delay_s = 0.004;
  m.parameters.driven_inertia = driven_inertia;
  m.parameters.load_inertia = load_inertia;
  m.parameters.stiffness = stiffness;
  m.parameters.damping = damping;
  return m;
}
fit::DriveModel system2() { return drive(0.032, 0.032, 143.75, 0.3); }
fit::DriveModel large_load() { return drive(0.01066666667, 0.05333333333, 239.7106356, 0.5002656744); }

/// 3 % of inertias and stiffness, 9 % of the damping, 0.2 ms.
Posterior posterior_of(const fit::DriveModel& model) {
  Eigen::VectorXd variances(5);
  variances << 9e-4, 9e-4, 9e-4, 81e-4, 4e-8;
  return {model,
          {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping, fit::kDelay},
          variances.asDiagonal()};
}

Bounds calm() {
  Bounds bounds;
  bounds.sensitivity = 1.4;
  bounds.load_transfer = 1.3;
  return bounds;
}

/// Runs the work and tells the least wall time of all runs, in ms: what other processes take from the machine
/// adds to some of them.
template <class Work>
void least_of(benchmark::State& state, const Work& work) {
  double least_ms = std::numeric_limits<double>::infinity();
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(work());
    const std::chrono::duration<double, std::milli> taken = std::chrono::steady_clock::now() - start;
    least_ms = std::min(least_ms, taken.count());
  }
  state.counters["least_ms"] = least_ms;
}

/// Rows of two bounds on 600 logarithmic lines, and the largest ki of 60 values of kp.
void exact_gains_600_lines_60_gains(benchmark::State& state) {
  const Machine machine(system2());
  std::vector<double> f(600);
  for (std::size_t i = 0; i < f.size(); ++i)
    f[i] = 250.0 * std::pow(1e-4, 1.0 - static_cast<double>(i) / 599.0);
  const auto plant = machine.response().at(f);
  std::vector<MachineLines::Line> lines;
  for (std::size_t i = 0; i < f.size(); ++i) {
    const auto q = integrator_at(f[i], 0.002);
    lines.push_back({f[i], plant[i], 1.0 - 0.002 / q, q});
  }
  least_of(state, [&] {
    QuadraticRows rows;
    for (const auto& line : lines) rows.add(line, 1.0, calm());
    const double limit = rows.largest_proportional();
    double best = 0.0;
    for (int i = 1; i <= 60; ++i) best = std::max(best, rows.largest_integral(limit * i / 60.0));
    return best;
  });
}
BENCHMARK(exact_gains_600_lines_60_gains)->Unit(benchmark::kMillisecond);

/// To the last digit, between the lines as well, with its stability.
void exact_gains(benchmark::State& state) {
  least_of(state, [] {
    Machines machines({Machine(system2())});
    return largest_integral_gain(machines, {}, calm());
  });
}
BENCHMARK(exact_gains)->Unit(benchmark::kMillisecond);

/// Maxima of two transfers of 10 000 machines, refined between the lines.
void monte_carlo_10000(benchmark::State& state) {
  const Posterior posterior = posterior_of(system2());
  least_of(state, [&] {
    return monte_carlo(posterior, FilteredPi{1.908059045, 18.4348455, {}}, calm(), 10'000, 1).exceeding;
  });
}
BENCHMARK(monte_carlo_10000)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

/// PI and one biquad at 95 %, searched inside, with 10 000 draws.
void confident_design_one_biquad(benchmark::State& state) {
  const Posterior posterior = posterior_of(large_load());
  Bounds bounds = calm();
  bounds.controller_sensitivity = 1.937;
  least_of(state, [&] { return confident_design(posterior, {.biquads = 1}, bounds, {})->iae; });
}
BENCHMARK(confident_design_one_biquad)->Unit(benchmark::kMillisecond)->MeasureProcessCPUTime();

}  // namespace
}  // namespace resonid::design
