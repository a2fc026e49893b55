// SPDX-License-Identifier: MIT
#include "eigenpairs.hpp"

#include <Eigen/Eigenvalues>

namespace resonid::plant::test {

Eigenpairs eigenpairs(const Eigen::Matrix<long double, -1, -1>& a) {
  const Eigen::EigenSolver<Eigen::Matrix<long double, -1, -1>> solver(a);
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace resonid::plant::test
