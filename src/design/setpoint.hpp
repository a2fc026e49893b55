// SPDX-License-Identifier: MIT
#pragma once

#include <optional>

#include "design/controller.hpp"
#include "design/machine.hpp"

// Set-point weight b of a PI controller, u = (kp (b r - y) + i) F (docs/methods/tune.md 5.2): chosen last,
// since no bound on a maximum over frequency depends on it.
namespace resonid::design {

/// What a step of the velocity reference by 1 rad/s does.
struct SetpointStep {
  double overshoot = 0.0;      ///< Load velocity above 1 rad/s, rad/s.
  double settling_s = 0.0;     ///< From when on the load stays within 2 %.
  double peak_torque = 0.0;    ///< Nm
  double rms_torque_1s = 0.0;  ///< Over the first second, Nm.
};
[[nodiscard]] SetpointStep setpoint_step_of(const Machine& machine, const FilteredPi& controller,
                                            double weight);

/// Largest weight, 0 ... 1, whose overshoot of the load is at most that; 0 where the loop swings by more even
/// so, since a weight cannot damp what the loop does not. Nothing where the loop is unstable.
[[nodiscard]] std::optional<double> largest_weight(const Machine& machine, const FilteredPi& controller,
                                                   double overshoot);

}  // namespace resonid::design
