// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <resonid/base/expected.hpp>

namespace resonid::plant {

/// Dry friction of one side of a drive, beside the viscous friction of its linear part.
struct DryFriction {
  double coulomb = 0.0;            ///< Torque while sliding.
  double breakaway = 0.0;          ///< Torque that it takes to start from rest; below `coulomb`: the same.
  double stribeck_velocity = 0.0;  ///< Velocity over which the one falls to the other.

  [[nodiscard]] bool any() const noexcept { return coulomb > 0.0 || breakaway > 0.0; }
  /// Torque that holds at rest.
  [[nodiscard]] double at_rest() const noexcept { return std::max(coulomb, breakaway); }
  /// Magnitude while sliding:  Tc + (Tb - Tc) exp(-(v/vs)^2).
  [[nodiscard]] double sliding(double velocity) const noexcept {
    if (!(stribeck_velocity > 0.0)) return coulomb;
    const double x = velocity / stribeck_velocity;
    return coulomb + (at_rest() - coulomb) * std::exp(-x * x);
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
  v("load_coulomb", c.load.coulomb, "the same of the load, referred to the driven shaft (Nm)");
  v("load_breakaway", c.load.breakaway, "likewise (Nm)");
  v("load_stribeck_velocity", c.load.stribeck_velocity, "likewise (rad/s)");
}

[[nodiscard]] expected<void, Error> check(const FrictionConfig& config) noexcept;

}  // namespace resonid::plant
