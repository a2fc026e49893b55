// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>

namespace resonid::recursive {

/// Matrices of at most kMaxBounded rows and columns, kept inside the object: no heap. Their algebra is
/// compiled once, for every order of model, instead of being unrolled for each.
inline constexpr int kMaxBounded = 12;
using BoundedMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxBounded, kMaxBounded>;

/// A^-1 B of a symmetric positive definite A.
[[nodiscard]] BoundedMatrix solve_positive(const BoundedMatrix& a, const BoundedMatrix& b) noexcept;

/// A^-1 B of any square A.
[[nodiscard]] BoundedMatrix solve_square(const BoundedMatrix& a, const BoundedMatrix& b) noexcept;

/// Least real part of the eigenvalues; A finite.
[[nodiscard]] double least_real_eigenvalue(const BoundedMatrix& a) noexcept;

/// Covariance X that white residuals leave in the parameters of a pseudo-linear recursion, P being per unit
/// residual variance and `share` = sum of squared weights over sum of weights (1 without forgetting, 1/(1 +
/// lambda) with):
///
///   (M - d) X + X (M - d)' = variance P      d = 1 - 1/(2 share)
///
/// which is variance P share for M = I. Infinite where the recursion does not settle, Re eig M <= d.
[[nodiscard]] BoundedMatrix recursion_covariance(const BoundedMatrix& m, const BoundedMatrix& p,
                                                 double variance, double share) noexcept;

}  // namespace resonid::recursive
