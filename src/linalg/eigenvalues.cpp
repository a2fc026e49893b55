// SPDX-License-Identifier: MIT
#include <Eigen/Eigenvalues>

#include "linalg/decompositions.hpp"

namespace resonid::linalg {

Eigen::VectorXcd eigenvalues(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  return Eigen::EigenSolver<Eigen::MatrixXd>(m, false).eigenvalues();
}

Eigenpairs eigenpairs(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(m);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

SymmetricEigenpairs symmetric_eigenpairs(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(m);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace resonid::linalg
