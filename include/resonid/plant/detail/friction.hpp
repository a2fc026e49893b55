// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <resonid/base/expected.hpp>

namespace resonid::plant {

/// Dry friction of one side of a drive, beside the viscous friction of its linear part. `way` is the sign of
/// the velocity, at rest that of the torque that pulls.
struct DryFriction {
  double coulomb = 0.0;            ///< Torque while sliding.
  double breakaway = 0.0;          ///< Torque that it takes to start from rest; below Coulomb's: that.
  double stribeck_velocity = 0.0;  ///< Velocity over which the one falls to the other.
  double coulomb_negative = 0.0;   ///< `coulomb` in the negative direction, 0: the same.

  [[nodiscard]] bool any() const noexcept {
    return coulomb > 0.0 || breakaway > 0.0 || coulomb_negative > 0.0;
  }
  [[nodiscard]] double coulomb_of(int way) const noexcept {
    return way < 0 && coulomb_negative > 0.0 ? coulomb_negative : coulomb;
  }
  /// Torque that holds at rest.
  [[nodiscard]] double at_rest(int way = 1) const noexcept { return std::max(coulomb_of(way), breakaway); }
  /// Magnitude while sliding:  Tc + (Tb - Tc) exp(-(v/vs)^2).
  [[nodiscard]] double sliding(double speed, int way = 1) const noexcept {
    const double slow = coulomb_of(way);
    if (!(stribeck_velocity > 0.0)) return slow;
    const double x = speed / stribeck_velocity;
    return slow + (at_rest(way) - slow) * std::exp(-x * x);
  }
};

/// Coulomb and Stribeck friction on the driven side and on the load.
struct FrictionConfig {
  DryFriction driven;
  DryFriction load;
};
template <class Visitor>
void describe(Visitor&& v, FrictionConfig& c) {
  v("coulomb", c.driven.coulomb, "sliding friction of the driven side, >= 0 (Nm)");
  v("breakaway", c.driven.breakaway, "friction of the driven side at rest; 0: as when sliding (Nm)");
  v("stribeck_velocity", c.driven.stribeck_velocity,
    "velocity over which breakaway falls to coulomb as exp(-(v/vs)^2), >= 0 (rad/s)");
  v("coulomb_friction_negative", c.driven.coulomb_negative,
    "sliding friction of the driven side in the negative direction; 0: as coulomb (Nm)");
  v("load_coulomb", c.load.coulomb, "the same of the load, referred to the driven shaft (Nm)");
  v("load_breakaway", c.load.breakaway, "likewise (Nm)");
  v("load_stribeck_velocity", c.load.stribeck_velocity, "likewise (rad/s)");
  v("load_coulomb_friction_negative", c.load.coulomb_negative, "likewise (Nm)");
}

[[nodiscard]] expected<void, Error> check(const FrictionConfig& config) noexcept;

}  // namespace resonid::plant
