// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <vector>

namespace resonid::plant {

/// What disturbs a machine from outside, and how it changes while it runs.
struct DisturbanceConfig {
  double load_torque = 0.0;
  std::vector<double> load_step = {};
  std::vector<double> load_step_at_s = {};
  double eccentricity = 0.0;
  double stiffness_drift_per_s = 0.0;
  double loosening = 0.0;
  double loosening_at_s = 0.0;
  double loosening_over_s = 0.0;
};
template <class Visitor>
void describe(Visitor&& v, DisturbanceConfig& c) {
  v("load_torque", c.load_torque,
    "constant torque on the load, at the driven shaft, present from the start; negative: against positive "
    "velocity (Nm)");
  v("load_step", c.load_step,
    "steps of the load's torque at the driven shaft, each added to what is there (Nm)");
  v("load_step_at_s", c.load_step_at_s, "their times, as many (s)");
  v("eccentricity", c.eccentricity,
    "amplitude by which a roller out of centre stretches the first coupling, once per turn of the driven "
    "side (rad; m of a belt when radius_m is given)");
  v("stiffness_drift_per_s", c.stiffness_drift_per_s,
    "relative change of every stiffness per second, > -1 over the run (1/s)");
  v("loosening", c.loosening, "share of every stiffness that a fault takes away, >= 0 and < 1");
  v("loosening_at_s", c.loosening_at_s, "when the fault begins, >= 0 (s)");
  v("loosening_over_s", c.loosening_over_s, "how long it takes, 0: at once (s)");
}

[[nodiscard]] expected<void, Error> check(const DisturbanceConfig& config) noexcept;

/// Stiffness at a time over that at the start.
[[nodiscard]] double stiffness_factor(const DisturbanceConfig& config, double time_s) noexcept;

}  // namespace resonid::plant
