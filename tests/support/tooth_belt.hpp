// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/linear_system.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/positive_real.hpp>

namespace resonid::test {

/// Two masses joined by a spring and a damper, sampled: driven torque to driven velocity.
inline online::DiscreteModel<double, 3> two_masses(double driven, double load, double stiffness,
                                                   double damping, double sample_time_s) {
  LinearSystem<double, 3> machine;  // velocities of both, twist
  machine.a << -damping / driven, damping / driven, -stiffness / driven, damping / load, -damping / load,
      stiffness / load, 1.0, -1.0, 0.0;
  machine.b << 1.0 / driven, 0.0, 0.0;
  machine.c << 1.0, 0.0, 0.0;
  const auto sampled = zero_order_hold(machine, sample_time_s);
  // Faddeev and Leverrier: coefficients of det(z - A) and of c adj(z - A) b.
  online::DiscreteModel<double, 3> m;
  Eigen::Matrix3d adjoint = Eigen::Matrix3d::Identity();
  for (int i = 0; i < 3; ++i) {
    m.b[static_cast<std::size_t>(i)] = sampled.c * adjoint * sampled.b;
    const double a = -(sampled.a * adjoint).trace() / (i + 1);
    m.a[static_cast<std::size_t>(i)] = a;
    adjoint = sampled.a * adjoint + a * Eigen::Matrix3d::Identity();
  }
  return m;
}

/// The tooth belt of Publications II, III and V with its cart at `place_m`, sampled.
inline online::DiscreteModel<double, 3> tooth_belt(double place_m, double sample_time_s,
                                                   double quality = 10.0) {
  constexpr double kPulley = 0.0028, kCart = 6.7, kRadius = 0.0199, kSpecific = 376406.25;
  const double near = kSpecific / place_m, far = kSpecific / (1.7 - place_m), below = kSpecific / 2.14;
  const double stiffness = (near + far * below / (far + below)) * kRadius * kRadius;
  const double load = kCart * kRadius * kRadius;
  const double omega = std::sqrt(stiffness * (1.0 / kPulley + 1.0 / load)),
               damping = stiffness / (omega * quality);
  return two_masses(kPulley, load, stiffness, damping, sample_time_s);
}

/// Its soft PI within a position loop, as in the golden files and in experiments/ii_iii_tooth_prbs.toml.
inline online::ControllerCoefficients tooth_belt_controller(double sample_time_s, double gain = 0.12) {
  const double proportional = gain * (1.0 + sample_time_s / 0.2), outer = 1.0 + 5.0 * sample_time_s;
  online::ControllerCoefficients c;
  c.numerator = {proportional * outer, -proportional - gain * outer, gain};
  c.denominator = {1.0, -2.0, 1.0};
  return c;
}

}  // namespace resonid::test
