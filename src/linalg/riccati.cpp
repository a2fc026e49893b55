// SPDX-License-Identifier: MIT
#include "linalg/riccati.hpp"

#include "linalg/decompositions.hpp"

namespace resonid::linalg {

std::optional<Eigen::MatrixXd> solve_riccati(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                             const Eigen::Ref<const Eigen::MatrixXd>& b,
                                             const Eigen::Ref<const Eigen::MatrixXd>& q,
                                             const Eigen::Ref<const Eigen::MatrixXd>& r) {
  const Eigen::Index n = a.rows();
  constexpr int kMost = 36;  // 2^36 samples: longer, rounding alone would settle a pole on the circle
  constexpr double kConverged = 1e-14, kSettled = 1e-6;
  Eigen::MatrixXd transition = a, g = b * RealLu(r).solve(b.transpose()), x = q;
  for (int step = 0; step < kMost; ++step) {
    const RealLu mix(Eigen::MatrixXd::Identity(n, n) + g * x);
    const Eigen::MatrixXd on = mix.solve(transition);
    const Eigen::MatrixXd more = transition.transpose() * x * on;
    g += transition * mix.solve(g) * transition.transpose();
    g = (0.5 * (g + g.transpose())).eval();
    x += more;
    x = (0.5 * (x + x.transpose())).eval();
    transition = (transition * on).eval();
    if (!x.allFinite() || !g.allFinite()) return std::nullopt;
    // What is left of the transition of the closed loop over so many samples: 1 where a pole stays on the
    // circle.
    const bool settled = transition.cwiseAbs().maxCoeff() < kSettled;
    if (settled && more.cwiseAbs().maxCoeff() <= kConverged * x.cwiseAbs().maxCoeff()) return x;
  }
  return std::nullopt;
}

}  // namespace resonid::linalg
