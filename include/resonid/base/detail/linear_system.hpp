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
  const Matrix scaled = a * Scalar(scale);
  Matrix sum = Matrix::Identity(a.rows(), a.cols());
  for (int k = kTerms; k >= 1; --k) {  // Horner: I + A/1 (I + A/2 (I + ...))
    sum = (scaled * sum).eval() * Scalar(1.0 / k);
    sum.diagonal().array() += Scalar(1);
  }
  for (int k = 0; k < squarings; ++k) sum = (sum * sum).eval();
  return sum;
}

/// Zero-order-hold equivalent over `step_s`: the input is constant between samples (METHOD 2.5).
/// `norm_bound` as in matrix_exponential, of A * step_s extended by b * step_s.
template <class Scalar, int Order>
LinearSystem<Scalar, Order> zero_order_hold(const LinearSystem<Scalar, Order>& continuous, Scalar step_s,
                                            double norm_bound) {
  Eigen::Matrix<Scalar, Order + 1, Order + 1> extended;
  extended.setZero();
  extended.template topLeftCorner<Order, Order>() = continuous.a * step_s;
  extended.template topRightCorner<Order, 1>() = continuous.b * step_s;
  const auto exponential = matrix_exponential<Scalar, Order + 1>(extended, norm_bound);
  LinearSystem<Scalar, Order> discrete;
  discrete.a = exponential.template topLeftCorner<Order, Order>();
  discrete.b = exponential.template topRightCorner<Order, 1>();
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
