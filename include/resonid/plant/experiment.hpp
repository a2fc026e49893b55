// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/excitation/excitation.hpp>
#include <resonid/plant/controller.hpp>
#include <resonid/plant/drive.hpp>
#include <span>

namespace resonid::plant {

struct MeasurementConfig {
  double delay_s = 0.0;
  double noise_rms = 0.0;
};
template <class Visitor>
void describe(Visitor&& v, MeasurementConfig& c) {
  v("delay_s", c.delay_s, "delay of the measured velocity, whole samples or not, >= 0 (s)");
  v("noise_rms", c.noise_rms, "standard deviation of white noise on the measured velocity, >= 0 (rad/s)");
}

struct RunConfig {
  double sample_rate_hz = 0.0;
  double duration_s = 0.0;
  double reference = 0.0;
  std::uint64_t seed = 1;
};
template <class Visitor>
void describe(Visitor&& v, RunConfig& c) {
  v("sample_rate_hz", c.sample_rate_hz, "of controller and record, > 0 (Hz)");
  v("duration_s", c.duration_s, "length of the record; 0: one period, sweep or stepped measurement (s)");
  v("reference", c.reference, "constant velocity reference; the run starts settled at it (rad/s)");
  v("seed", c.seed, "seed of the measurement noise");
}

/// One experiment on a simulated drive.
struct ExperimentConfig {
  DriveConfig drive;
  ControllerConfig controller;
  excitation::ExcitationConfig excitation;
  MeasurementConfig measurement;
  RunConfig run;
};
template <class Visitor>
void describe(Visitor&& v, ExperimentConfig& c) {
  v("drive", c.drive, "the machine");
  v("controller", c.controller, "the velocity controller");
  v("excitation", c.excitation, "what is added to the controller's output");
  v("measurement", c.measurement, "how the velocity is measured");
  v("run", c.run, "how the experiment is run");
}

[[nodiscard]] expected<void, ConfigError> check(const MeasurementConfig& config) noexcept;
[[nodiscard]] expected<void, ConfigError> check(const RunConfig& config) noexcept;

/// What is true of a simulated experiment, for those who judge an identification by it.
struct Truth {
  Structure structure = Structure::two_mass;
  data::Motion motion = data::Motion::rotary;
  std::optional<data::TwoMassParameters> two_mass;  ///< At the driven shaft; not for a rigid machine.
  double rigid_inertia = 0.0;                       ///< Rigid machine only.
  double viscous_friction = 0.0;
  data::TransferFunction plant;                      ///< Zero-order-hold equivalent without the delay.
  std::optional<data::TransferFunction> controller;  ///< None in open loop.
  double delay_s = 0.0;                              ///< Of the measured velocity, not part of `plant`.
  data::FrequencyResponse response;                  ///< Of `plant`, no delay.
  std::uint64_t seed = 0;
};

struct Simulation {
  data::Record record;  ///< ru, u, y and, in closed loop, r.
  Truth truth;
};

/// Runs the experiment. `response_hz` are the frequencies of the true response; when empty, those of a
/// multisine or a stepped sine, else 200 over the excitation's band in even ratio. The same configuration
/// gives the same samples.
[[nodiscard]] expected<Simulation, ConfigError> simulate_closed_loop(
    const ExperimentConfig& config, std::span<const double> response_hz = {});

}  // namespace resonid::plant
