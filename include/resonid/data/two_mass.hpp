// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <resonid/base/detail/linear_system.hpp>

namespace resonid::data {

/// Two inertias joined by a spring and a damper, everything referred to the driven shaft (Nevaranta 2016,
/// eqs. 2.1-2.3 with r1 = r2 = 1; the coupled belt has stiffness K r^2 and damping D r^2). SI units of the
/// motion: kgm2, Nm/rad, Nms/rad, or kg, N/m, Ns/m.
template <class Scalar>
struct TwoMass {
  Scalar driven_inertia{};
  Scalar load_inertia{};
  Scalar stiffness{};
  Scalar damping{};
  Scalar viscous_friction{};  ///< On the driven side, torque per velocity.
};
using TwoMassParameters = TwoMass<double>;

/// Undamped resonance sqrt(K (1/J1 + 1/J2)) in Hz.
[[nodiscard]] double resonance_hz(const TwoMassParameters& p);
/// Undamped anti-resonance sqrt(K/J2) in Hz, seen from the driven side.
[[nodiscard]] double antiresonance_hz(const TwoMassParameters& p);
/// Damping ratio of the resonance, D/2 (1/J1 + 1/J2)/w_res.
[[nodiscard]] double resonance_damping_ratio(const TwoMassParameters& p);
/// Damping ratio of the anti-resonance, D/(2 J2 w_ares).
[[nodiscard]] double antiresonance_damping_ratio(const TwoMassParameters& p);

/// Torque on the driven side to its velocity. States: driven velocity, load velocity, and the twist (driven
/// minus load angle) times the resonance frequency: scaled so, the matrix exponential needs hardly any
/// squaring.
template <class Scalar>
[[nodiscard]] LinearSystem<Scalar, 3> continuous_system(const TwoMass<Scalar>& p) {
  using std::sqrt;
  const Scalar omega = sqrt(p.stiffness * (Scalar(1) / p.driven_inertia + Scalar(1) / p.load_inertia));
  const Scalar spring = p.stiffness / omega;
  LinearSystem<Scalar, 3> s;
  s.a << -(p.damping + p.viscous_friction) / p.driven_inertia, p.damping / p.driven_inertia,
      -spring / p.driven_inertia,                                                        //
      p.damping / p.load_inertia, -p.damping / p.load_inertia, spring / p.load_inertia,  //
      omega, -omega, Scalar(0);
  s.b << Scalar(1) / p.driven_inertia, Scalar(0), Scalar(0);
  s.c << Scalar(1), Scalar(0), Scalar(0);
  return s;
}

}  // namespace resonid::data
