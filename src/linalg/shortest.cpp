// SPDX-License-Identifier: MIT
#include "linalg/decompositions.hpp"

namespace resonid::linalg {

Eigen::VectorXd shortest_solution(const Eigen::Ref<const Eigen::MatrixXd>& m,
                                  const Eigen::Ref<const Eigen::VectorXd>& right) {
  return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(m).solve(right);
}

PseudoInverse pseudo_inverse(const Eigen::Ref<const Eigen::MatrixXd>& m) {
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors(m);
  return {factors.pseudoInverse(), factors.rank()};
}

}  // namespace resonid::linalg
