// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>

// Dry friction of one side of a drive over a part of a sample in which the torque on it is even.
namespace resonid::fit::detail {

/// One size for both directions: two sizes are, in motion and at rest, their mean and a constant torque.
struct FrictionLaw {
  double coulomb = 0.0;   ///< Torque while sliding; the size in whose parts a course is kept.
  double excess = 0.0;    ///< By how much the torque that it takes to start from rest is larger.
  double velocity = 0.0;  ///< Over which that falls as exp(-(v/velocity)^2), Stribeck's.

  [[nodiscard]] double at_rest() const { return coulomb + std::max(0.0, excess); }
  [[nodiscard]] double sliding(double speed) const {
    if (!(excess > 0.0) || !(velocity > 0.0)) return coulomb;
    constexpr double kNothing = 40.0;  // nothing that counts is left of it
    const double square = std::pow(speed / velocity, 2);
    return square < kNothing ? coulomb + excess * std::exp(-square) : coulomb;
  }
};

/// Mean torque against the motion over the part: coulomb * direction + stuck.
struct FrictionTorque {
  double direction = 0.0;
  double stuck = 0.0;
};

/// Of a side that would go from `velocity` to `free` without friction, and by -gain * torque less with it: it
/// slides to the end, or up to a standstill, from where it rests or, pulled by more than there is of friction
/// at rest, slides back. Friction that falls with the speed is that in the middle of the way.
inline FrictionTorque slide_or_stick(const FrictionLaw& law, double velocity, double free, double gain) {
  const double pull = (free - velocity) / gain;
  const double way = velocity > 0.0 ? 1.0 : velocity < 0.0 ? -1.0 : pull > 0.0 ? 1.0 : -1.0;
  const double speed = std::abs(velocity);
  double slides = law.sliding(speed);
  if (law.excess > 0.0) {
    const double middle = 0.5 * (speed + way * free - gain * slides);
    slides = law.sliding(std::max(middle, 0.5 * speed));
  }
  const double given = law.coulomb;
  if (way * free > gain * slides || way * pull > slides) return {way, way * (slides - given)};
  if (std::abs(pull) <= law.at_rest()) return {0.0, free / gain};
  const double share = speed / (gain * (slides - way * pull));  // of the time, until it turns back
  const double back = law.sliding(0.0);
  return {way * (2.0 * share - 1.0), way * ((slides - given) * share - (back - given) * (1.0 - share))};
}

}  // namespace resonid::fit::detail
