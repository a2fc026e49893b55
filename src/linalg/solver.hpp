// SPDX-License-Identifier: MIT
#pragma once

#include "linalg/decompositions.hpp"

namespace resonid::linalg {

template <class Decomposition>
Solver<Decomposition>::Solver(const Eigen::Ref<const Matrix>& m) : of_(m) {}

template <class Decomposition>
auto Solver<Decomposition>::solve_vector(const Eigen::Ref<const Vector>& right) const -> Vector {
  return of_.solve(right);
}

template <class Decomposition>
auto Solver<Decomposition>::solve_matrix(const Eigen::Ref<const Matrix>& right) const -> Matrix {
  return of_.solve(right);
}

}  // namespace resonid::linalg
