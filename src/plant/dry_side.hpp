// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/plant/detail/friction.hpp>

namespace resonid::plant {

/// The driven side or the load under dry friction: it slides one way, or rests. Torques in Nm, velocities in
/// rad/s, inertia in kgm2, at the driven shaft.
struct DrySide {
  DrySide(const DryFriction& of, double its_inertia) noexcept
      : friction(of), inertia(its_inertia), per_inertia(1.0 / its_inertia) {
    constexpr double kSteepest = 0.8577638849;  // sqrt(2/e), of exp(-x^2)
    const double fall = std::max(friction.at_rest(1) - friction.coulomb_of(1),
                                 friction.at_rest(-1) - friction.coulomb_of(-1));
    if (friction.stribeck_velocity > 0.0 && fall > 0.0)
      steady_s = 0.1 * inertia * friction.stribeck_velocity / (kSteepest * fall);
  }

  static constexpr double kForEver = std::numeric_limits<double>::infinity();
  static constexpr double kFlat = 3.0;  // Stribeck velocities: exp(-9) = 1e-4 of the fall is left

  DryFriction friction;
  double inertia;
  double per_inertia;
  double steady_s = kForEver;  // longest step in falling friction
  int direction = 0;           // of sliding; 0: at rest
  double pull = 0.0;           // torque on it without friction, now
  double torque = 0.0;         // magnitude of friction over the step

  [[nodiscard]] bool slides() const noexcept { return friction.any() && direction != 0; }
  [[nodiscard]] bool rests() const noexcept { return friction.any() && direction == 0; }
  [[nodiscard]] double acceleration() const noexcept { return (pull - direction * torque) * per_inertia; }

  void start(int way) noexcept {
    direction = way;
    torque = friction.sliding(0.0, way);
  }
  void start_if_pulled() noexcept {
    if (std::abs(pull) > holding(pull)) start(pull > 0.0 ? 1 : -1);
  }

  /// What friction at rest can hold of such a torque.
  [[nodiscard]] double holding(double pulled) const noexcept {
    return friction.at_rest(pulled < 0.0 ? -1 : 1);
  }

  /// By its acceleration now.
  [[nodiscard]] bool stops_soon(double velocity, double duration_s) const noexcept {
    return slides() && direction * (velocity + duration_s * acceleration()) < 0.0;
  }
  /// How long friction may be held at one value (s): while the velocity changes by half of the Stribeck
  /// velocity, and for a tenth of the time in which the falling friction makes motion grow by e. Further
  /// than three Stribeck velocities from rest it is constant.
  [[nodiscard]] double longest_hold(double velocity) const noexcept {
    if (!slides() || !(steady_s < kForEver)) return kForEver;
    const double vs = friction.stribeck_velocity;
    const double far = direction * velocity - kFlat * vs;
    const double rate = direction * acceleration();
    if (far > 0.0 && rate >= 0.0) return kForEver;
    if (far > 0.5 * vs) return far / -rate;
    return std::min(0.5 * vs / std::abs(rate), steady_s);
  }
  /// Friction over a step from `velocity`: that at the velocity in the middle of the step, or of the way to
  /// rest where it stops before. Second order.
  void hold(double velocity, double duration_s) noexcept {
    const double speed = direction * velocity;
    if (speed < kFlat * friction.stribeck_velocity && speed != 0.0)
      torque = friction.sliding(speed, direction);  // for acceleration()
    const double middle = speed + 0.5 * duration_s * direction * acceleration();
    const double slowest = std::max(middle, 0.5 * speed);
    torque = slowest > 6.1 * friction.stribeck_velocity
                 ? friction.coulomb_of(direction)  // exp(-6.1^2) < 2^-53
                 : friction.sliding(slowest, direction);
  }
};

}  // namespace resonid::plant
