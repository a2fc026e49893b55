// SPDX-License-Identifier: MIT
#include <fit/drive/score.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {

void score(const Eigen::MatrixXd& factor, Eigen::Index estimated, double variance,
           std::vector<Lacking>& found) {
  if (!factor.allFinite() || !(variance > 0.0)) return;
  // Columns scaled to length one: the coordinates differ by orders of magnitude.
  Eigen::MatrixXd taken = factor.leftCols(estimated);
  for (Eigen::Index i = 0; i < estimated; ++i) taken.col(i) /= std::max(taken.col(i).norm(), 1e-300);
  Eigen::MatrixXd rest = factor.rightCols(factor.cols() - estimated);
  const Eigen::VectorXd before = rest.colwise().squaredNorm();
  rest -= taken * (linalg::pseudo_inverse(taken).matrix * rest);
  constexpr double kSame = 1e-14;  // of a slope that the estimated ones hold already: rounding
  const Eigen::Index residual = rest.cols() - 1;
  for (Eigen::Index i = 0; i < residual; ++i) {
    const double size = rest.col(i).squaredNorm();
    if (!(size > kSame * before(i))) continue;
    const double along = rest.col(i).dot(rest.col(residual));
    found[static_cast<std::size_t>(i)].gain = along * along / (size * variance);
  }
}

}  // namespace resonid::fit::detail
