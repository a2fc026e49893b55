// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <limits>
#include <resonid/base/error_text.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/instrumental_variables.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>
#include <vector>

namespace resonid::test {

/// A simulated run with what an estimator of discrete models is given, and the truth sample by sample.
struct LoopRun {
  plant::Simulation simulation;
  online::DiscreteModel<double, 3> machine;  ///< At the start of the run.
  std::size_t delay_samples = 0;
  std::vector<double> resonance_hz;  ///< [sample]

  [[nodiscard]] double sample_rate_hz() const { return simulation.record.sample_rate_hz; }
  [[nodiscard]] std::size_t samples() const { return simulation.record.samples(); }
};

inline online::DiscreteModel<double, 3> discrete_model(const data::TransferFunction& plant) {
  online::DiscreteModel<double, 3> m;
  for (std::size_t i = 0; i < 3; ++i) {
    m.b[i] = plant.numerator.at(i + 1) / plant.denominator.at(0);
    m.a[i] = plant.denominator.at(i + 1) / plant.denominator.at(0);
  }
  return m;
}

inline double resonance_hz(const online::DiscreteModel<double, 3>& model, double sample_rate_hz) {
  const auto modes = online::SampledModes<3>(model, sample_rate_hz).resonances();
  return modes.empty() ? 0.0 : modes[0].frequency_hz;
}

inline LoopRun run_loop(const plant::ExperimentConfig& config) {
  auto simulation = plant::simulate_closed_loop(config);
  if (!simulation) throw std::runtime_error(message_of(simulation.error()));
  LoopRun run{std::move(*simulation), {}, 0, {}};
  run.machine = discrete_model(run.simulation.truth.plant);
  run.delay_samples =
      static_cast<std::size_t>(std::lround(config.measurement.delay_s * config.run.sample_rate_hz));
  const double constant = run.simulation.truth.resonances.at(0).frequency_hz;
  run.resonance_hz.assign(run.samples(), constant);
  if (const auto& changes = run.simulation.truth.over_time) {
    std::size_t j = 0;
    for (std::size_t k = 0; k < run.samples(); ++k) {
      const double t = static_cast<double>(k) / run.sample_rate_hz();
      while (j + 2 < changes->time_s.size() && changes->time_s[j + 1] < t) ++j;
      const double part = (t - changes->time_s[j]) / (changes->time_s[j + 1] - changes->time_s[j]);
      const double to = changes->resonance_hz[j + 1], from = changes->resonance_hz[j];
      run.resonance_hz[k] = from + std::min(1.0, std::max(0.0, part)) * (to - from);
    }
  }
  return run;
}

/// The tooth belt of Publications II and III, cart at 0.06 m/s.
inline plant::ExperimentConfig moving_cart(bool fast, double noise, std::uint64_t seed) {
  auto c = io::shipped_experiment(fast ? "ii_iii_tooth_prbs_2ms" : "ii_iii_tooth_prbs");
  c.measurement.noise_rms = noise;
  c.run.seed = seed;
  return c;
}
/// The model with which estimators of the moving cart begin: the belt at 0.6 m.
inline online::DiscreteModel<double, 3> cart_at_middle(bool fast) {
  auto c = io::shipped_experiment("ii_tooth_standstill");
  c.motion.from = 0.6;
  c.run.sample_rate_hz = fast ? 500.0 : 250.0;
  c.measurement.delay_s = 1.0 / c.run.sample_rate_hz;
  c.run.duration_s = 0.1;
  return run_loop(c).machine;
}
/// The same belt with the stiffness that it has at 0.8 m, and without the cascade's position loop: a machine
/// that does not change by itself being shaken. The stiffness is scaled by `stiffer`, the gain by `tighter`.
inline plant::ExperimentConfig constant_belt(double sample_rate_hz, double noise, std::uint64_t seed,
                                             double tighter = 1.0, double stiffer = 1.0) {
  auto c = io::shipped_experiment("ii_tooth_standstill");
  const double radius = 0.0199, cart = 6.7, pulley = 0.0028, specific = 3.764e5;
  const double in_series = specific / 2.14, beyond = specific / (1.7 - 0.8);
  const double stiffness = specific / 0.8 + beyond * in_series / (beyond + in_series);
  c.drive = plant::DriveConfig{};
  c.drive.driven_inertia = pulley;
  c.drive.load_inertia = cart * radius * radius;
  c.drive.radius_m = radius;
  c.drive.stiffness = stiffness * stiffer;
  c.drive.damping = stiffness / (10.0 * std::sqrt(stiffness * (1.0 / cart + radius * radius / pulley)));
  c.motion = plant::MotionConfig{};
  c.controller.kind = plant::ControllerKind::pi;
  c.controller.gain *= tighter;
  c.measurement.noise_rms = noise;
  c.measurement.delay_s = 1.0 / sample_rate_hz;
  c.run = {sample_rate_hz, 4500.0 / sample_rate_hz, seed};
  return c;
}

inline online::InstrumentalVariablesConfig<3> instrumental(const LoopRun& run) {
  online::InstrumentalVariablesConfig<3> c;
  c.start = run.machine;
  c.controller_numerator = run.simulation.truth.controller->numerator;
  c.controller_denominator = run.simulation.truth.controller->denominator;
  c.delay_samples = run.delay_samples;
  return c;
}

}  // namespace resonid::test
