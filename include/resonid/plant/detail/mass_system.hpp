// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <resonid/data/mode.hpp>
#include <vector>

namespace resonid::plant {

/// A spring and a damper side by side between two masses.
struct Coupling {
  std::size_t from = 0;    ///< Index of a mass.
  std::size_t to = 1;      ///< Index of another mass.
  double stiffness = 0.0;  ///< Nm/rad (N/m)
  double damping = 0.0;    ///< Nms/rad (Ns/m)
};

/// Any number of inertias joined by springs and dampers, referred to the driven shaft.
/// Mass 0 is the driven side, the last one the load. Couplings may form loops, as a belt with a tensioner
/// does.
struct MassSystem {
  std::vector<double> inertia;  ///< [mass], > 0 (kgm2, kg)
  std::vector<double> viscous;  ///< [mass], torque per velocity to the ground, >= 0 (Nms/rad, Ns/m)
  std::vector<Coupling> couplings;
  std::vector<double> ground =
      {};  ///< [mass] or empty: spring to the ground, at rest at angle 0 (Nm/rad, N/m)

  [[nodiscard]] std::size_t masses() const noexcept { return inertia.size(); }
  /// Whether a spring holds it in its place, so that its angle acts on its motion.
  [[nodiscard]] bool grounded() const noexcept {
    return std::any_of(ground.begin(), ground.end(), [](double k) { return k > 0.0; });
  }
};

/// The linear machine, dx/dt = a x + b [command; torque on mass 0 ... N-1].
///
/// States: velocities of the masses; angles of masses 1 ... N-1 less that of mass 0, times `angle_scale` (a
/// frequency of the system, so that the matrix exponential needs few squarings); with a torque-loop lag the
/// motor's torque; last the angle of mass 0. The command is the motor's torque itself where there is no lag.
/// Row i < N of a and b, times the inertia of mass i, is the sum of the torques on it.
struct ContinuousDrive {
  Eigen::MatrixXd a;
  Eigen::MatrixXd b;
  double angle_scale = 1.0;
};

/// `lag_s` is the time constant of the torque loop, 0: none. `angle_scale` > 0
/// is taken as given, so that states of a machine whose stiffness varies stay comparable.
[[nodiscard]] ContinuousDrive continuous_drive(const MassSystem& system, double lag_s,
                                               double angle_scale = 0.0);

/// Undamped natural frequencies of the machine, ascending, without the rigid-body mode of a free one.
[[nodiscard]] std::vector<data::UndampedMode> resonances(const MassSystem& system);
/// Those with the driven mass clamped: the anti-resonances of the response from torque to driven velocity.
[[nodiscard]] std::vector<data::UndampedMode> antiresonances(const MassSystem& system);

}  // namespace resonid::plant
