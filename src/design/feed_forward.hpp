// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <optional>
#include <resonid/fit/drive_model.hpp>
#include <vector>

#include "design/cascade.hpp"
#include "design/machine.hpp"

// What a position loop is told beside its reference (docs/methods/tune.md 8.3, 8.4).
namespace resonid::design {

/// From rest to rest along a polynomial of 9th degree, continuous up to snap.
struct PolynomialMove {
  double distance_rad = 1.0;
  double duration_s = 1.0;

  /// Position and its derivatives by time, up to the 9th; those of rest before and after.
  [[nodiscard]] std::array<double, 10> at(double time_s) const;
};

/// Each adds to what stands before it.
enum class FeedForward {
  none,      ///< The position alone.
  velocity,  ///< Its velocity, to the velocity loop.
  inertia,   ///< The torque that the whole inertia takes.
  delayed,   ///< Feedback compares with the reference as late as it measures.
  flexible   ///< The motor's path and torque that take the load of a two-mass drive along the reference,
             ///< exactly.
};

/// What one sample of a move asks for.
struct MoveSample {
  double load_position = 0.0;  ///< Where the load is meant to be, rad.
  double position = 0.0;       ///< With what feedback compares, rad.
  double velocity = 0.0;       ///< rad/s, to the velocity loop.
  double torque = 0.0;         ///< Nm, to the motor.
};

/// A move as the controller takes it, by a model of the drive; `coulomb_nm`: friction of the driven side that
/// is fed forward, with the model's viscous one. Nothing for a flexible one of a drive that is not of two
/// masses, or is tied to the ground.
[[nodiscard]] std::optional<std::vector<MoveSample>> move_samples(const fit::DriveModel& model,
                                                                  const PolynomialMove& move,
                                                                  FeedForward kind, std::size_t samples,
                                                                  double coulomb_nm = 0.0);

/// What a move did.
struct MoveFigures {
  double error_during = 0.0;  ///< Largest distance of the load from where it is meant to be, rad.
  double error_after = 0.0;   ///< The same once the reference rests.
  double peak_torque = 0.0;   ///< Nm
  double rms_torque = 0.0;    ///< Nm, over all samples.
};
/// The move on a machine, whose driven side has Coulomb friction of that size beside what the machine knows.
[[nodiscard]] MoveFigures move_figures_of(const Machine& machine, const Cascade& cascade,
                                          const std::vector<MoveSample>& samples, double duration_s,
                                          double coulomb_nm = 0.0);

}  // namespace resonid::design
