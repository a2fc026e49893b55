// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

namespace resonid::fit::detail {

/// States s(k+1) = transition s(k) + input v(k): a basis F_i(z) = e_i^T (zI - transition)^-1 input of all
/// strictly proper functions over one denominator. Scaled so that the states are orthonormal for white v:
/// filters and normal equations stay sound where powers of z^-1 would lose all digits.
///
///   G = (sum c_i F_i + h) / (1 + sum alpha_i F_i)  has the transition  transition - input alpha^T
///
/// so a step alpha in the denominator is a state feedback, and the basis can be renewed after every step.
/// Source: input-normal form (Mullis and Roberts 1976); data-driven local coordinates (McKelvey et al. 2004).
struct Realisation {
  Eigen::MatrixXd transition;
  Eigen::VectorXd input;

  [[nodiscard]] Eigen::Index order() const noexcept { return input.size(); }
  [[nodiscard]] Eigen::VectorXcd poles() const;
};

/// Poles in conjugate pairs. Those beyond 1 - 1/horizon are scaled as if they lay there.
[[nodiscard]] Realisation realisation_of(std::vector<std::complex<double>> poles, double horizon);

/// The realisation after a step alpha, orthonormal again, and T with s_old = T s_new. Nothing when a pole
/// leaves the circle of radius `limit` or the scaling fails.
struct Renewed {
  Realisation realisation;
  Eigen::MatrixXd states;
};
[[nodiscard]] std::optional<Renewed> renewed(const Realisation& r, const Eigen::VectorXd& alpha,
                                             double horizon, double limit);

/// Coefficients in powers of z^-1 of prod (1 - p/z), and in the columns of `numerators` those of F_i times it
/// (rows z^-1 ... z^-n). By evaluation on a circle and an inverse Fourier transform, which is as exact as the
/// coefficients allow.
struct Polynomials {
  Eigen::VectorXd denominator;
  Eigen::MatrixXd numerators;
};
[[nodiscard]] Polynomials polynomials(const Realisation& r);

/// (zI - transition)^-1 input
[[nodiscard]] Eigen::VectorXcd basis(const Realisation& r, std::complex<double> z);

}  // namespace resonid::fit::detail
