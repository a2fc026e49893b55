// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <optional>

namespace resonid::linalg {

/// Stabilising solution X of the discrete algebraic Riccati equation
///   X = a' X a - a' X b (r + b' X b)^-1 b' X a + q
/// with q symmetric and not negative, r symmetric and positive. By structure-preserving doubling (Chu et al.
/// 2004): each step does as much as all before it, a may be singular, and no eigenvalues have to
/// be sorted. Nothing where it does not converge: (a, b) is not stabilisable, or q leaves a mode on the
/// circle unseen.
[[nodiscard]] std::optional<Eigen::MatrixXd> solve_riccati(const Eigen::Ref<const Eigen::MatrixXd>& a,
                                                           const Eigen::Ref<const Eigen::MatrixXd>& b,
                                                           const Eigen::Ref<const Eigen::MatrixXd>& q,
                                                           const Eigen::Ref<const Eigen::MatrixXd>& r);

}  // namespace resonid::linalg
