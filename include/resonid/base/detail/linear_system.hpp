// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <type_traits>

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

/// A matrix and its derivatives by `count` variables, in plain numbers.
template <int Order, int Most>
struct MatrixWithSlopes {
  using Matrix = Eigen::Matrix<double, Order, Order>;
  Matrix value;
  std::array<Matrix, static_cast<std::size_t>(Most)> slope;
  std::size_t count = 0;

  /// this = first * this / divisor + I
  void horner(const MatrixWithSlopes& first, double divisor) {
    for (std::size_t s = 0; s < count; ++s)
      slope[s] = (plain_product(first.slope[s], value) + plain_product(first.value, slope[s])) / divisor;
    value = Matrix::Identity() + plain_product(first.value, value) / divisor;
  }
  void square() {
    for (std::size_t s = 0; s < count; ++s)
      slope[s] = plain_product(slope[s], value) + plain_product(value, slope[s]);
    value = plain_product(value, value);
  }
};

/// How often exp(A) is squared after a Taylor series of A / 2^n, |A| <= norm_bound.
[[nodiscard]] inline int squarings_of_exponential(double norm_bound) noexcept {
  int squarings = 0;
  for (; std::ldexp(norm_bound, -squarings) > 0.5 && squarings < 60; ++squarings) {
  }
  return squarings;
}
inline constexpr int kExponentialTerms = 14;  // 0.5^15/15! = 2e-17
[[nodiscard]] constexpr double inverse_factorial(int n) noexcept {
  double product = 1.0;
  for (int k = 2; k <= n; ++k) product *= k;
  return 1.0 / product;
}

/// exp(A) by scaling and squaring of a Taylor series; relative error near machine precision for |A| up to a
/// few hundred. `norm_bound` is a plain number not below the infinity norm of A.
template <class Scalar, int Order>
requires std::is_floating_point_v<Scalar> Eigen::Matrix<Scalar, Order, Order> matrix_exponential(
    const Eigen::Matrix<Scalar, Order, Order>& a, double norm_bound) {
  using Matrix = Eigen::Matrix<Scalar, Order, Order>;
  const int squarings = squarings_of_exponential(norm_bound);
  const auto scale_by = [](Matrix& m, double factor) {
    for (Eigen::Index j = 0; j < m.cols(); ++j)
      for (Eigen::Index i = 0; i < m.rows(); ++i) m(i, j) *= Scalar(factor);
  };
  Matrix scaled = a;
  scale_by(scaled, std::ldexp(1.0, -squarings));
  // Four terms at a time, so that six products do for sixteen (Paterson and Stockmeyer 1973).
  const Matrix second = plain_product(scaled, scaled), third = plain_product(second, scaled),
               fourth = plain_product(second, second);
  Matrix sum = Matrix::Zero(a.rows(), a.cols());
  for (int k = 12; k >= 0; k -= 4) {
    if (k < 12) sum = plain_product(sum, fourth);
    const double c0 = inverse_factorial(k), c1 = c0 / (k + 1), c2 = c1 / (k + 2), c3 = c2 / (k + 3);
    for (Eigen::Index j = 0; j < sum.cols(); ++j) {
      for (Eigen::Index i = 0; i < sum.rows(); ++i)
        sum(i, j) += Scalar(c1) * scaled(i, j) + Scalar(c2) * second(i, j) + Scalar(c3) * third(i, j);
      sum(j, j) += Scalar(c0);
    }
  }
  for (int k = 0; k < squarings; ++k) sum = plain_product(sum, sum);
  return sum;
}

/// The same of automatic-differentiation scalars (value `a`, derivatives `v`), by the product rule over the
/// derivatives that are not zero throughout A: few are, and plain matrices take a tenth of the time.
template <class Scalar, int Order>
requires(!std::is_floating_point_v<Scalar>) Eigen::Matrix<Scalar, Order, Order> matrix_exponential(
    const Eigen::Matrix<Scalar, Order, Order>& a, double norm_bound) {
  constexpr int kMost = Scalar::DIMENSION;
  const int squarings = squarings_of_exponential(norm_bound);
  MatrixWithSlopes<Order, kMost> scaled;
  std::array<int, static_cast<std::size_t>(kMost)> by{};
  for (int p = 0; p < kMost; ++p) {
    bool any = false;
    for (Eigen::Index k = 0; k < a.size() && !any; ++k) any = a.data()[k].v(p) != 0.0;
    if (any) by[scaled.count++] = p;
  }
  for (Eigen::Index k = 0; k < a.size(); ++k) {
    scaled.value.data()[k] = std::ldexp(a.data()[k].a, -squarings);
    for (std::size_t s = 0; s < scaled.count; ++s)
      scaled.slope[s].data()[k] = std::ldexp(a.data()[k].v(by[s]), -squarings);
  }
  auto sum = scaled;
  sum.value.setIdentity();
  for (std::size_t s = 0; s < sum.count; ++s) sum.slope[s].setZero();
  for (int k = kExponentialTerms; k >= 1; --k) sum.horner(scaled, k);
  for (int k = 0; k < squarings; ++k) sum.square();
  Eigen::Matrix<Scalar, Order, Order> result;
  for (Eigen::Index k = 0; k < a.size(); ++k) {
    result.data()[k] = Scalar(sum.value.data()[k]);
    for (std::size_t s = 0; s < sum.count; ++s) result.data()[k].v(by[s]) = sum.slope[s].data()[k];
  }
  return result;
}

/// Zero-order-hold equivalent over `step_s`: the input is constant between samples (Astrom and
/// Wittenmark 1997, ch. 2).
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
