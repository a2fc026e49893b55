// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/plant/detail/disturbance.hpp>
#include <resonid/plant/detail/friction.hpp>

namespace resonid::plant {

expected<void, Error> check(const FrictionConfig& c) noexcept {
  if (!(c.driven.coulomb >= 0.0)) return refuse("coulomb", "must be >= 0", c.driven.coulomb);
  if (!(c.driven.breakaway >= 0.0)) return refuse("breakaway", "must be >= 0", c.driven.breakaway);
  if (!(c.driven.stribeck_velocity >= 0.0))
    return refuse("stribeck_velocity", "must be >= 0", c.driven.stribeck_velocity);
  if (!(c.driven.coulomb_negative >= 0.0))
    return refuse("coulomb_friction_negative", "must be >= 0", c.driven.coulomb_negative);
  if (!(c.load.coulomb >= 0.0)) return refuse("load_coulomb", "must be >= 0", c.load.coulomb);
  if (!(c.load.breakaway >= 0.0)) return refuse("load_breakaway", "must be >= 0", c.load.breakaway);
  if (!(c.load.stribeck_velocity >= 0.0))
    return refuse("load_stribeck_velocity", "must be >= 0", c.load.stribeck_velocity);
  if (!(c.load.coulomb_negative >= 0.0))
    return refuse("load_coulomb_friction_negative", "must be >= 0", c.load.coulomb_negative);
  return {};
}

expected<void, Error> check(const DisturbanceConfig& c) noexcept {
  if (!std::isfinite(c.load_torque)) return refuse("load_torque", "must be finite", c.load_torque);
  if (c.load_step.size() != c.load_step_at_s.size())
    return refuse("load_step_at_s", "must hold as many times as load_step holds steps");
  for (const double at : c.load_step_at_s)
    if (!(at >= 0.0)) return refuse("load_step_at_s", "must be >= 0", at);
  if (!std::isfinite(c.eccentricity)) return refuse("eccentricity", "must be finite", c.eccentricity);
  if (!std::isfinite(c.stiffness_drift_per_s))
    return refuse("stiffness_drift_per_s", "must be finite", c.stiffness_drift_per_s);
  if (!(c.loosening >= 0.0 && c.loosening < 1.0))
    return refuse("loosening", "must be >= 0 and < 1", c.loosening);
  if (!(c.loosening_at_s >= 0.0)) return refuse("loosening_at_s", "must be >= 0", c.loosening_at_s);
  if (!(c.loosening_over_s >= 0.0)) return refuse("loosening_over_s", "must be >= 0", c.loosening_over_s);
  return {};
}

double stiffness_factor(const DisturbanceConfig& c, double time_s) noexcept {
  double loose = 0.0;
  if (time_s >= c.loosening_at_s) {
    const double since = time_s - c.loosening_at_s;
    loose = c.loosening * (since < c.loosening_over_s ? since / c.loosening_over_s : 1.0);
  }
  return (1.0 + c.stiffness_drift_per_s * time_s) * (1.0 - loose);
}

}  // namespace resonid::plant
