// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <fit/drive/friction_parts.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <span>
#include <vector>

namespace resonid::fit::detail {

/// What a record gives to a simulation. Filtering all of it by a noise model commutes with drive and
/// controller, both being linear.
struct DriveSignals {
  std::vector<double> input;      ///< Torque; in closed loop the excitation.
  std::vector<double> reference;  ///< In closed loop only.
  std::vector<double> output;
  std::vector<double>
      direction;  ///< Of sliding: -1 ... 1 as a mean over the sample; empty without dry friction.
  /// Friction torque beside Coulomb's times direction: of samples that end at rest all of it; with no
  /// `direction` always.
  std::vector<double> stuck;
  /// [part][sample] What direction and stuck are beyond their means over the sample; empty: nothing.
  std::array<std::vector<double>, kFrictionParts> direction_parts, stuck_parts;
  /// [part][sample] Friction torque on the load; empty: none.
  std::array<std::vector<double>, kFrictionParts> on_load;
  std::vector<std::vector<double>> pushes;  ///< [mass][sample] Further torques; an empty one: none.
  double constant = 1.0;                    ///< What a constant becomes.
  std::vector<bool> unused;  ///< [sample] of the output: no residual is taken there; empty: none.
};

[[nodiscard]] DriveSignals whitened(const DriveSignals& raw, const NoiseModel& noise);

/// Torque of dry friction along its course, [kFrictionParts sample + part], and back as one that is given: on
/// the driven side, on the load (empty: none).
[[nodiscard]] std::vector<double> friction_of(const DriveSignals& signals, double coulomb);
[[nodiscard]] std::vector<double> load_friction_of(const DriveSignals& signals);
void take_friction(std::span<const double> torque, DriveSignals& signals);
void take_load_friction(std::span<const double> torque, DriveSignals& signals);

}  // namespace resonid::fit::detail
