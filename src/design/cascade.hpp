// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/design/detail/bounds.hpp>

#include "design/controller.hpp"
#include "design/largest_gain.hpp"
#include "design/machine.hpp"

// Position over velocity (docs/methods/tune.md 8.1, 8.2). The position is the backward-Euler sum of the
// measured velocity: exact where a drive differentiates its encoder.
namespace resonid::design {

struct Cascade {
  FilteredPi velocity;
  double kv = 0.0;  ///< Velocity reference per position error, 1/s.
};
/// From velocity error to torque, C (1 + kv Ts z/(z-1)); the reference is that of the position, in velocity.
[[nodiscard]] LinearController linear_controller(const Cascade& cascade, double sample_time_s);

/// What a torque step of 1 Nm against the load does to the measured position.
struct PositionStep {
  double iae = 0.0;   ///< rad s
  double ie = 0.0;    ///< 1/(ki kv) (docs/methods/tune.md 2.2)
  double peak = 0.0;  ///< rad
};
/// Infinite where the loop is unstable.
[[nodiscard]] PositionStep position_step_of(const Machine& machine, const Cascade& cascade);

/// 1.4 on |S|, and on |position of the load by its reference| what leaves it next to no overshoot.
[[nodiscard]] Bounds default_cascade_bounds();

/// Largest kv that meets every bound at every frequency of every machine, exactly: the bounds are quadratic
/// in it. `load_transfer` bounds the position of the load by its reference. Nothing where the velocity loop
/// takes all the room that the bounds leave, or no gain is stable. Lines at which a bound is nearly reached
/// are added to `machines`.
[[nodiscard]] std::optional<double> largest_kv(Machines& machines, const FilteredPi& velocity,
                                               const Bounds& bounds);

struct CascadeDesign {
  Cascade cascade;
  double iae = 0.0;  ///< Of the position after a load step, the mean over the machines, rad s.
};
/// kp, ki and kv together for the least integrated error of the position after a load step.
[[nodiscard]] std::optional<CascadeDesign> search_cascade(Machines& machines, const Bounds& bounds,
                                                          const std::vector<Biquad>& biquads = {});

}  // namespace resonid::design
