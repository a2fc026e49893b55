// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <resonid/data/mode.hpp>
#include <resonid/data/two_mass.hpp>

namespace resonid::data {

/// Three inertias in a row, joined by two springs and dampers, everything referred to the driven shaft
/// (docs/methods/drive_models.md): driven, middle, load. `stiffness` and `damping` lie between driven and
/// middle, `stiffness_2` and `damping_2` between middle and load.
template <class Scalar>
struct ThreeMass : TwoMass<Scalar> {
  Scalar middle_inertia{};
  Scalar stiffness_2{};
  Scalar damping_2{};
  Scalar load_viscous_friction{};   ///< On the load, torque per velocity.
  Scalar motor_ground_stiffness{};  ///< Spring from the driven side to the ground; < 0: gravity that topples.
  Scalar load_ground_stiffness{};   ///< The same from the load.

  ThreeMass() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): two masses are three with nothing between
  ThreeMass(const TwoMass<Scalar>& two, const Scalar& middle = {}, const Scalar& k2 = {},
            const Scalar& d2 = {})
      : TwoMass<Scalar>(two), middle_inertia(middle), stiffness_2(k2), damping_2(d2) {}
  ThreeMass(const Scalar& driven, const Scalar& load, const Scalar& k, const Scalar& d, const Scalar& viscous)
      : TwoMass<Scalar>{driven, load, k, d, viscous} {}
};
using ThreeMassParameters = ThreeMass<double>;

/// Torque on the driven side to its velocity. States: velocities of driven side, middle and load, and the two
/// twists (nearer minus farther angle), each times the frequency at which its two inertias alone would swing.
/// Springs to the ground are left out: they need the position.
template <class Scalar>
[[nodiscard]] LinearSystem<Scalar, 5> continuous_system(const ThreeMass<Scalar>& p) {
  using std::sqrt;
  const Scalar one(1);
  const Scalar near_omega = sqrt(p.stiffness * (one / p.driven_inertia + one / p.middle_inertia));
  const Scalar far_omega = sqrt(p.stiffness_2 * (one / p.middle_inertia + one / p.load_inertia));
  const Scalar near_spring = p.stiffness / near_omega;
  const Scalar far_spring = p.stiffness_2 / far_omega;
  LinearSystem<Scalar, 5> s;
  s.a.setZero();
  s.a(0, 0) = -(p.damping + p.viscous_friction) / p.driven_inertia;
  s.a(0, 1) = p.damping / p.driven_inertia;
  s.a(0, 3) = -near_spring / p.driven_inertia;
  s.a(1, 0) = p.damping / p.middle_inertia;
  s.a(1, 1) = -(p.damping + p.damping_2) / p.middle_inertia;
  s.a(1, 2) = p.damping_2 / p.middle_inertia;
  s.a(1, 3) = near_spring / p.middle_inertia;
  s.a(1, 4) = -far_spring / p.middle_inertia;
  s.a(2, 1) = p.damping_2 / p.load_inertia;
  s.a(2, 2) = -(p.damping_2 + p.load_viscous_friction) / p.load_inertia;
  s.a(2, 4) = far_spring / p.load_inertia;
  s.a(3, 0) = near_omega;
  s.a(3, 1) = -near_omega;
  s.a(4, 1) = far_omega;
  s.a(4, 2) = -far_omega;
  s.b.setZero();
  s.b(0) = one / p.driven_inertia;
  s.c.setZero();
  s.c(0) = one;
  return s;
}

/// The two resonances of the free chain, ascending; with the driven side `clamped`, the two anti-resonances.
/// The damping ratio is that of the mode alone, phi' D phi/(2 w phi' M phi), viscous friction left out.
[[nodiscard]] std::array<UndampedMode, 2> undamped_modes(const ThreeMassParameters& p, bool clamped);

/// The undamped chain of given total inertia with these anti-resonances and resonances, a1 < r1 < a2 < r2:
/// T/v = s J1 + 1/(s/K1 + 1/(s Jm + 1/(s/K2 + 1/(s J2)))), expanded step by step (Cauer's ladder). Both
/// dampings are left at zero.
[[nodiscard]] ThreeMassParameters three_mass_of_modes(double total_inertia,
                                                      const std::array<double, 2>& antiresonances_hz,
                                                      const std::array<double, 2>& resonances_hz);

}  // namespace resonid::data
