// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <resonid/plant/detail/drive.hpp>
#include <vector>

namespace resonid::plant::test {

using Real = long double;
using Complex = std::complex<Real>;

/// What a machine does by its equations of motion, in long double and without any matrix exponential: the
/// transfer function from torque to driven velocity as a sum of residue/(s - pole), each term of which is
/// sampled by hand. The equations are written down here from the configuration, not taken from the library.
class Analytic {
 public:
  /// `stiffness_factor` as in the library; a tooth belt at `position_m`.
  explicit Analytic(const DriveConfig& c, double torque_lag_s = 0.0, double position_m = 0.0);

  /// Of a tooth belt, N/m and Ns/m.
  [[nodiscard]] Real stiffness() const { return stiffness_; }
  [[nodiscard]] Real damping() const { return damping_; }
  [[nodiscard]] const std::vector<Complex>& poles() const { return poles_; }

  /// From torque, held over a sample, to the driven velocity `delay` = (whole + early) samples before it.
  [[nodiscard]] Complex sampled(Real frequency_hz, Real step_s, int whole = 0, Real early = 0) const;
  /// Likewise to the mean of that velocity over the past sample time: the difference of two positions.
  [[nodiscard]] Complex sampled_difference(Real frequency_hz, Real step_s, int whole = 0,
                                           Real early = 0) const;

 private:
  struct Spring {
    std::size_t from, to;
    Real stiffness, damping;
  };
  /// States: velocities; twists of neighbours; the motor's angle where springs to the ground hold the
  /// machine; the motor's torque where it lags.
  void decompose(Real viscous, Real viscous_load, Real lag_s);

  std::vector<Real> inertia_;
  std::vector<Spring> springs_;
  Real motor_ground_ = 0, load_ground_ = 0;
  Real stiffness_ = 0, damping_ = 0;
  std::vector<Complex> poles_, residues_;
};

}  // namespace resonid::plant::test
