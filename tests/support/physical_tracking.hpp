// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/plant/detail/mass_system.hpp>
#include <resonid/plant/experiment.hpp>
#include <stdexcept>

namespace resonid::test {

using PhysicalTracker = online::PhysicalTracker<double>;

inline plant::Simulation physical_simulation(const plant::ExperimentConfig& experiment) {
  auto simulation = plant::simulate_closed_loop(experiment);
  if (!simulation) throw std::runtime_error(message_of(simulation.error()));
  return std::move(*simulation);
}

/// What a user of the experiment knows without the machine's parameters.
inline online::PhysicalTrackerConfig physical_config(const plant::ExperimentConfig& experiment) {
  online::PhysicalTrackerConfig c;
  c.sample_rate_hz = experiment.run.sample_rate_hz;
  c.delay_s = experiment.measurement.delay_s;
  return c;
}

/// Tooth belt from the model at 0.6 m, with the oracle's trust in it (tests/golden, e_expected.json).
inline online::PhysicalTrackerConfig tooth_belt_config(const plant::ExperimentConfig& experiment,
                                                       double stiffness_drift_per_s) {
  const double r2 = experiment.drive.radius_m * experiment.drive.radius_m;
  auto c = physical_config(experiment);
  c.driven_inertia = {0.0028, 0.1};
  c.load_inertia = {6.7 * r2, 0.1};
  c.stiffness = {743518.519 * r2, 0.5};
  c.damping = {159.931471 * r2, 0.3};
  c.stiffness_drift_per_s = stiffness_drift_per_s;
  return c;
}

/// Error of the tracked resonance over several seeds, at the time that it is told of.
struct ResonanceError {
  double rms_percent = 0.0;
  double largest_percent = 0.0;
  double normalised = 0.0;  ///< Mean squared error over the claimed variance.
  double lag_s = 0.0;       ///< Mean.
};
inline ResonanceError tooth_belt_error(plant::ExperimentConfig experiment, double stiffness_drift_per_s,
                                       double from_s, std::uint64_t seeds, bool at_best_known_time = false) {
  ResonanceError error;
  double count = 0.0;
  auto config = tooth_belt_config(experiment, stiffness_drift_per_s);
  config.at_best_known_time = at_best_known_time;
  const auto tracker = std::make_unique<PhysicalTracker>(PhysicalTracker::create(config).value());
  for (experiment.run.seed = 1; experiment.run.seed <= seeds; ++experiment.run.seed) {
    const auto record = physical_simulation(experiment).record;
    tracker->reset();
    for (std::size_t k = 0; k < record.samples(); ++k) {
      tracker->step(0.0, record.input.samples[k], record.output.samples[k]);
      if (static_cast<double>(k) < from_s * record.sample_rate_hz) continue;
      const double lag = tracker->lag_samples();
      const auto described = static_cast<double>(k) - lag;
      const auto before = static_cast<std::size_t>(described);
      const auto& x = record.position.samples;
      const double place =
          lag > 0.0 ? x[before] + (described - std::floor(described)) * (x[before + 1] - x[before]) : x[k];
      const auto machine = plant::mass_system(experiment.drive, 1.0, place);
      const double truth_hz = plant::resonances(machine)[0].frequency_hz;
      const double percent = 100.0 * (tracker->resonance_hz() / truth_hz - 1.0);
      error.normalised += std::pow((tracker->resonance_hz() - truth_hz) / tracker->resonance_std_hz(), 2);
      error.lag_s += lag / record.sample_rate_hz;
      error.rms_percent += percent * percent;
      error.largest_percent = std::max(error.largest_percent, std::abs(percent));
      count += 1.0;
    }
  }
  error.rms_percent = std::sqrt(error.rms_percent / count);
  error.normalised /= count;
  error.lag_s /= count;
  return error;
}

/// How good estimates of J1, J2, K, D, f_res are at the end of a record, over several seeds; each from its
/// own start, which is off by between `least` and `most` in every parameter, upwards or downwards.
struct ParameterScatter {
  std::array<double, 5> rms_percent{};
  std::array<double, 5> mean_percent{};
  std::uint64_t astray = 0;  ///< Seeds whose squared error is more than ten times what the filter says.
  double normalised =
      0.0;  ///< Squared error over the filter's own covariance, per parameter: 1 when it is right.
};
inline ParameterScatter parameter_scatter(plant::ExperimentConfig experiment, double least, double most,
                                          std::uint64_t seeds) {
  const auto& d = experiment.drive;
  const double r2 = d.radius_m * d.radius_m;
  const std::array<double, 4> truth{d.driven_inertia, d.load_inertia, d.stiffness * r2, d.damping * r2};
  const double resonance = std::sqrt(truth[2] * (1.0 / truth[0] + 1.0 / truth[1])) / kTwoPi;
  ParameterScatter scatter;
  const double n = static_cast<double>(seeds);
  for (std::uint64_t seed = 1; seed <= seeds; ++seed) {
    experiment.run.seed = seed;
    std::mt19937_64 generator(seed + 7777);
    const auto uniform = [&generator] { return static_cast<double>(generator() >> 11) * 0x1p-53; };
    auto c = physical_config(experiment);
    const std::array<online::StartingValue*, 4> start{&c.driven_inertia, &c.load_inertia, &c.stiffness,
                                                      &c.damping};
    for (std::size_t i = 0; i < 4; ++i) {
      const double off = 1.0 + least + (most - least) * uniform();
      *start[i] = {uniform() < 0.5 ? truth[i] * off : truth[i] / off, std::log1p(most)};
    }
    const auto tracker = std::make_unique<PhysicalTracker>(PhysicalTracker::create(c).value());
    const auto record = physical_simulation(experiment).record;
    for (std::size_t k = 0; k < record.samples(); ++k)
      tracker->step(0.0, record.input.samples[k], record.output.samples[k]);
    Eigen::Vector4d error;
    for (std::size_t i = 0; i < 4; ++i)
      error(static_cast<int>(i)) =
          std::log(tracker->value(static_cast<online::PhysicalParameter>(i)) / truth[i]);
    const Eigen::Matrix4d covariance = tracker->log_covariance().topLeftCorner<4, 4>();
    const double normalised = error.dot(covariance.ldlt().solve(error)) / 4.0;
    if (normalised > 10.0) ++scatter.astray;
    scatter.normalised += normalised / n;
    for (std::size_t i = 0; i < 5; ++i) {
      const double percent =
          100.0 * (i < 4 ? error(static_cast<int>(i)) : std::log(tracker->resonance_hz() / resonance));
      scatter.rms_percent[i] += percent * percent / n;
      scatter.mean_percent[i] += percent / n;
    }
  }
  for (double& rms : scatter.rms_percent) rms = std::sqrt(rms);
  return scatter;
}

/// Cramer-Rao bounds (1 sd, %) of J1, J2, K, D, f_res for the published sweep of 17 s, 1 Nm, noise 0.1 rad/s,
/// by an independent implementation (tests/golden/README.md). System 3 is driven on its J2 side.
inline constexpr std::array<double, 5> kSweepBoundSystem2{0.482, 0.845, 0.563, 1.394, 0.106};
inline constexpr std::array<double, 5> kSweepBoundSystem3{0.494, 0.933, 0.609, 1.934, 0.109};

}  // namespace resonid::test
