// SPDX-License-Identifier: MIT
#include "linalg/solver.hpp"

namespace resonid::linalg {

template <class Matrix>
double Lu<Matrix>::rcond() const {
  return this->of_.rcond();
}

template <class Matrix>
Matrix Lu<Matrix>::inverse() const {
  return this->of_.inverse();
}

template class Solver<Eigen::PartialPivLU<Eigen::MatrixXd>>;
template class Solver<Eigen::PartialPivLU<Eigen::MatrixXcd>>;
template class Lu<Eigen::MatrixXd>;
template class Lu<Eigen::MatrixXcd>;

Eigen::MatrixXd inverse(const Eigen::Ref<const Eigen::MatrixXd>& m) { return RealLu(m).inverse(); }

Eigen::MatrixXd solve_upper(const Eigen::Ref<const Eigen::MatrixXd>& upper,
                            const Eigen::Ref<const Eigen::MatrixXd>& right) {
  return upper.triangularView<Eigen::Upper>().solve(right);
}

Eigen::MatrixXd solve_lower(const Eigen::Ref<const Eigen::MatrixXd>& lower,
                            const Eigen::Ref<const Eigen::MatrixXd>& right) {
  return lower.triangularView<Eigen::Lower>().solve(right);
}

}  // namespace resonid::linalg
