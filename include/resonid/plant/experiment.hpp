// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/plant/closed_loop.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::plant {

struct RunConfig {
  double sample_rate_hz = 0.0;
  double duration_s = 0.0;
  std::uint64_t seed = 1;
};
template <class Visitor>
void describe(Visitor&& v, RunConfig& c) {
  v("sample_rate_hz", c.sample_rate_hz,
    "of controller and recording, more than twice the highest resonance (Hz)");
  v("duration_s", c.duration_s, "length of the recording; 0: one period, sweep or stepped measurement (s)");
  v("seed", c.seed, "seed of the measurement noise");
}

/// One experiment on a simulated drive.
struct ExperimentConfig {
  DriveConfig drive;
  FrictionConfig friction;
  DisturbanceConfig disturbance;
  ActuatorConfig actuator;
  ControllerConfig controller;
  MotionConfig motion;
  online::ExcitationConfig excitation;
  MeasurementConfig measurement;
  RunConfig run;
};
template <class Visitor>
void describe(Visitor&& v, ExperimentConfig& c) {
  v("drive", c.drive, "the machine");
  v("friction", c.friction, "dry friction of the machine");
  v("disturbance", c.disturbance, "what disturbs the machine, and how it changes");
  v("actuator", c.actuator, "the torque loop");
  v("controller", c.controller, "the velocity controller");
  v("motion", c.motion, "the reference of the run; a standstill without this table");
  v("excitation", c.excitation, "what is added to the controller's output");
  v("measurement", c.measurement, "how the velocity is measured");
  v("run", c.run, "how the experiment is run");
}

[[nodiscard]] expected<void, Error> check(const RunConfig& config) noexcept;

/// Everything that can be known before the first sample: ranges, a sample rate above twice the highest
/// resonance, a motion within the stroke, and a closed loop that is stable (its poles with the delay, at
/// every stiffness that the run goes through; limits, quantisation and dry friction left aside). The error's
/// field is "TABLE.FIELD" of the experiment file, or the table alone: "controller.gain".
[[nodiscard]] expected<void> check(const ExperimentConfig& config);

/// How a machine that changes did so.
struct OverTime {
  std::vector<double> time_s;        ///< [instant]
  std::vector<double> resonance_hz;  ///< [instant], the first one, undamped
  std::vector<double> position_m;    ///< [instant], of a tooth belt's cart; else empty
};

/// What is true of a simulated experiment, for those who judge an identification by it. Of a machine that
/// changes: as it is at the start, and over time.
struct Truth {
  Structure structure = Structure::two_mass;
  data::Motion motion = data::Motion::rotary;
  MassSystem system;                                           ///< At the driven shaft.
  std::optional<data::TwoMassParameters> two_mass;             ///< Parameters of a two-mass machine only.
  std::vector<data::UndampedMode> resonances, antiresonances;  ///< Undamped, ascending.
  BentCoupling coupling;         ///< Model and response are those of the linear coupling in contact.
  double torque_lag_s = 0.0;     ///< Part of `plant`.
  double output_filter_s = 0.0;  ///< Time constant of the filter of the measured velocity; part of `plant`.
  std::size_t hold_samples = 1;  ///< Samples over which it is held then; part of `plant` in the mean.
  /// Zero-order-hold equivalent from u to what is measured, without the delay. A velocity from an encoder's
  /// differences is the mean over the past sample, and that is part of it; so are the filter of the velocity
  /// and, as 0 ... n-1 samples of delay in the mean, its hold.
  data::TransferFunction plant;
  SampledDrive sampled;  ///< `plant` as states, which keeps the digits that polynomials of high order lose.
  /// From measured velocity to -u; none in open loop. Of a cascade with its position before the filter.
  std::optional<data::TransferFunction> controller;
  /// The real loop C times what is measured, in 6000 frequencies up to half the sample rate; every delay in
  /// it, fractions of a sample exactly (`plant` times e^{-jwTd} is that for whole samples only). Empty in
  /// open loop.
  data::FrequencyResponse loop;
  double delay_s = 0.0;              ///< Delay of the measured velocity, not part of `plant`.
  data::FrequencyResponse response;  ///< Response of `plant`, without delay.
  std::optional<OverTime> over_time;
  DryFriction friction, load_friction;
  std::uint64_t seed = 0;
};

struct Simulation {
  data::Record record;  ///< ru, u, y; in closed loop r; position where it matters (cascade, tooth belt);
                        ///< second_output.
  Truth truth;
};

/// The loop of the experiment at its start, for who steps it with the excitation and the noise that
/// simulate_closed_loop() would; for at most the run's duration. Errors are those of check().
[[nodiscard]] expected<ClosedLoop> make_loop(const ExperimentConfig& config);

/// Runs the experiment, in closed or open loop. `response_hz` are the frequencies of the true response; when
/// empty, those of a multisine or a stepped sine, else 200 over the excitation's band in even ratio. The same
/// configuration gives the same samples.
[[nodiscard]] expected<Simulation> simulate_closed_loop(const ExperimentConfig& config,
                                                        std::span<const double> response_hz = {});

}  // namespace resonid::plant
