// SPDX-License-Identifier: MIT
#include <algorithm>

#include "linalg/solver.hpp"

namespace resonid::linalg {

template class Solver<Eigen::HouseholderQR<Eigen::MatrixXd>>;
template class Solver<Eigen::ColPivHouseholderQR<Eigen::MatrixXd>>;

Eigen::MatrixXd Qr::thin_q() const {
  return of_.householderQ() * Eigen::MatrixXd::Identity(of_.rows(), of_.cols());
}

Eigen::MatrixXd Qr::upper() const {
  return of_.matrixQR().topRows(std::min(of_.rows(), of_.cols())).triangularView<Eigen::Upper>();
}

Eigen::MatrixXd PivotedQr::thin_q() const {
  return of_.householderQ() * Eigen::MatrixXd::Identity(of_.rows(), of_.cols());
}

Eigen::Index PivotedQr::rank(double threshold) const {
  const double least = of_.maxPivot() * (threshold > 0.0 ? threshold : of_.threshold());
  return (of_.matrixQR().diagonal().head(of_.nonzeroPivots()).array().abs() > least).count();
}

void qr_in_place(Eigen::MatrixXd& m) { const Eigen::HouseholderQR<Eigen::Ref<Eigen::MatrixXd>> factors(m); }

Eigen::MatrixXd upper_factor(const Eigen::Ref<const Eigen::MatrixXd>& rows) { return Qr(rows).upper(); }

}  // namespace resonid::linalg
