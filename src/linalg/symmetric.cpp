// SPDX-License-Identifier: MIT
#include "linalg/solver.hpp"

namespace resonid::linalg {

template <class Matrix>
double Ldlt<Matrix>::rcond() const {
  return this->of_.rcond();
}

Eigen::MatrixXd Llt::lower() const { return of_.matrixL(); }

template class Solver<Eigen::LDLT<Eigen::MatrixXd>>;
template class Solver<Eigen::LDLT<Eigen::MatrixXcd>>;
template class Solver<Eigen::LLT<Eigen::MatrixXd>>;
template class Ldlt<Eigen::MatrixXd>;
template class Ldlt<Eigen::MatrixXcd>;

}  // namespace resonid::linalg
