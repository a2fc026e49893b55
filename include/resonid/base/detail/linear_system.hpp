// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <complex>

namespace resonid {

/// Single-input single-output linear system  dx/dt = A x + b u,  y = c x + d u  (continuous), or
/// x(k+1) = A x(k) + b u(k),  y(k) = c x(k) + d u(k)  (discrete).
template <class Scalar, int Order>
struct LinearSystem {
  using Matrix = Eigen::Matrix<Scalar, Order, Order>;
  using Column = Eigen::Matrix<Scalar, Order, 1>;
  using Row = Eigen::Matrix<Scalar, 1, Order>;
  Matrix a = Matrix::Zero();
  Column b = Column::Zero();
  Row c = Row::Zero();
  Scalar d = Scalar(0);
};

/// A B in plain loops: an expression of Eigen takes many times as long to compile, for numbers with
/// derivatives above all.
template <class Matrix>
[[nodiscard]] Matrix plain_product(const Matrix& a, const Matrix& b) {
  Matrix product = Matrix::Zero(a.rows(), b.cols());
  for (Eigen::Index j = 0; j < b.cols(); ++j)
    for (Eigen::Index k = 0; k < a.cols(); ++k)
      for (Eigen::Index i = 0; i < a.rows(); ++i) product(i, j) += a(i, k) * b(k, j);
  return product;
}

/// exp(A) by scaling and squaring of a Taylor series; relative error near machine precision for |A| up to a
/// few hundred. Works for automatic-differentiation scalars too, so exact derivatives come for free.
/// `norm_bound` is a plain number not below the infinity norm of A.
template <class Scalar, int Order>
Eigen::Matrix<Scalar, Order, Order> matrix_exponential(const Eigen::Matrix<Scalar, Order, Order>& a,
                                                       double norm_bound) {
  using Matrix = Eigen::Matrix<Scalar, Order, Order>;
  constexpr int kTerms = 14;  // 0.5^15/15! = 2e-17
  int squarings = 0;
  double scale = 1.0;
  while (norm_bound * scale > 0.5 && squarings < 60) {
    scale *= 0.5;
    ++squarings;
  }
  const auto scale_by = [](Matrix& m, double factor) {
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      for (Eigen::Index i = 0; i < m.rows(); ++i) m(i, j) *= Scalar(factor);
  };
  Matrix scaled = a;
  scale_by(scaled, scale);
  Matrix sum = Matrix::Identity(a.rows(), a.cols());
  for (int k = kTerms; k >= 1; --k) {  // Horner: I + A/1 (I + A/2 (I + ...))
    sum = plain_product(scaled, sum);
    scale_by(sum, 1.0 / k);
    for (Eigen::Index i = 0; i < sum.rows(); ++i) sum(i, i) += Scalar(1);
  }
  for (int k = 0; k < squarings; ++k) sum = plain_product(sum, sum);
  return sum;
}

/// Zero-order-hold equivalent over `step_s`: the input is constant between samples (METHOD 2.5).
/// `norm_bound` as in matrix_exponential, of A * step_s extended by b * step_s.
template <class Scalar, int Order>
LinearSystem<Scalar, Order> zero_order_hold(const LinearSystem<Scalar, Order>& continuous, Scalar step_s,
                                            double norm_bound) {
  using Extended = Eigen::Matrix<Scalar, Order + 1, Order + 1>;
  Extended extended = Extended::Zero();
  for (int i = 0; i < Order; ++i) {
    for (int j = 0; j < Order; ++j) extended(i, j) = continuous.a(i, j) * step_s;
    extended(i, Order) = continuous.b(i) * step_s;
  }
  const Extended exponential = matrix_exponential<Scalar, Order + 1>(extended, norm_bound);
  LinearSystem<Scalar, Order> discrete;
  for (int i = 0; i < Order; ++i) {
    for (int j = 0; j < Order; ++j) discrete.a(i, j) = exponential(i, j);
    discrete.b(i) = exponential(i, Order);
  }
  discrete.c = continuous.c;
  discrete.d = continuous.d;
  return discrete;
}

/// As above for plain floating-point systems: the norm is computed here.
template <class Scalar, int Order>
LinearSystem<Scalar, Order> zero_order_hold(const LinearSystem<Scalar, Order>& continuous, Scalar step_s) {
  double norm = 0.0;
  for (int i = 0; i < Order; ++i) {
    double row = std::abs(static_cast<double>(continuous.b(i)));
    for (int j = 0; j < Order; ++j) row += std::abs(static_cast<double>(continuous.a(i, j)));
    norm = std::max(norm, row);
  }
  return zero_order_hold<Scalar, Order>(continuous, step_s, norm * std::abs(static_cast<double>(step_s)));
}

}  // namespace resonid
