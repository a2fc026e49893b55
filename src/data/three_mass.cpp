// SPDX-License-Identifier: MIT
#include <algorithm>
#include <resonid/base/constants.hpp>
#include <resonid/data/three_mass.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::data {

std::array<UndampedMode, 2> undamped_modes(const ThreeMassParameters& p, bool clamped) {
  Eigen::MatrixXd stiffness(3, 3), damping(3, 3);
  const auto chain = [](double near, double far, Eigen::MatrixXd& m) {
    m << near, -near, 0.0, -near, near + far, -far, 0.0, -far, far;
  };
  chain(p.stiffness, p.stiffness_2, stiffness);
  chain(p.damping, p.damping_2, damping);
  Eigen::VectorXd scale(3);
  scale << p.driven_inertia, p.middle_inertia, p.load_inertia;
  scale = scale.cwiseSqrt().cwiseInverse().eval();
  stiffness = (scale.asDiagonal() * stiffness * scale.asDiagonal()).eval();
  damping = (scale.asDiagonal() * damping * scale.asDiagonal()).eval();
  if (clamped) {
    stiffness = stiffness.bottomRightCorner(2, 2).eval();
    damping = damping.bottomRightCorner(2, 2).eval();
  }
  std::array<UndampedMode, 2> modes;
  if (!stiffness.allFinite()) return modes;
  const auto axes = linalg::symmetric_eigenpairs(stiffness);
  const Eigen::Index first = clamped ? 0 : 1;  // the free chain turns as a whole
  for (Eigen::Index i = 0; i < 2; ++i) {
    const double omega = std::sqrt(std::max(0.0, axes.values(first + i)));
    const Eigen::VectorXd shape = axes.vectors.col(first + i);
    modes[static_cast<std::size_t>(i)] = {omega / kTwoPi,
                                          omega > 0.0 ? 0.5 * shape.dot(damping * shape) / omega : 0.0};
  }
  return modes;
}

ThreeMassParameters three_mass_of_modes(double total_inertia, const std::array<double, 2>& antiresonances_hz,
                                        const std::array<double, 2>& resonances_hz) {
  // z = T/(s v) = N/D over q = -s^2, as polynomials of second degree.
  const auto inverse_square = [](double hz) { return 1.0 / (kTwoPi * hz * kTwoPi * hz); };
  const auto polynomial = [&](const std::array<double, 2>& hz) {
    const double a = inverse_square(hz[0]), b = inverse_square(hz[1]);
    return std::array<double, 3>{1.0, -(a + b), a * b};
  };
  const auto d = polynomial(antiresonances_hz);
  const auto n = polynomial(resonances_hz);
  ThreeMassParameters p;
  p.driven_inertia = total_inertia * n[2] / d[2];
  const double m0 = total_inertia - p.driven_inertia;
  const double m1 = total_inertia * n[1] - p.driven_inertia * d[1];
  p.stiffness = -m1 / d[2];
  const double e1 = d[1] + m0 / p.stiffness;
  p.middle_inertia = m1 / e1;
  p.load_inertia = m0 - p.middle_inertia;
  p.stiffness_2 = -p.load_inertia / e1;
  return p;
}

}  // namespace resonid::data
