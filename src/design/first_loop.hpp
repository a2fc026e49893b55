// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>

#include "design/controller.hpp"

namespace resonid::design {

/// What is known of a machine before anything is identified. Either the motor's inertia, or the total one
/// with the largest ratio of load to motor; the total one may be left out where the ratio is there.
struct UnknownMachine {
  std::optional<double> motor_inertia;  ///< J1, kgm2: from the data sheet.
  std::optional<double> total_inertia;  ///< J, kgm2: by total_inertia_of().
  std::optional<double> largest_ratio;  ///< R_max, the largest J2/J1 that may be.
  double delay_s = 0.0;
  double torque_lag_s = 0.0;
  double sample_time_s = 0.0;
  double least_damping = 0.01;  ///< zeta_min of the resonance, whatever its frequency.
};

/// From two accelerations of opposite sign at one speed, at which friction is alike (docs/methods/tune.md
/// 13).
[[nodiscard]] double total_inertia_of(double torque_up, double acceleration_up, double torque_down,
                                      double acceleration_down);

/// A loop soft enough to excite any machine in: kp = J1 w1, ki = kp^2/(6 J), w1 = pi zeta_min/lag, half the
/// limit up to which every two-mass machine of that damping is stable (docs/methods/tune.md 13). From the
/// total inertia alone it is not: up to 40 % of the ratios and resonances are unstable with kp = J w1.
[[nodiscard]] expected<FilteredPi> first_loop(const UnknownMachine& machine);

}  // namespace resonid::design
