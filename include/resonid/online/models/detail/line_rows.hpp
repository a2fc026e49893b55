// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/base/constants.hpp>
#include <resonid/online/models/discrete_model.hpp>

namespace resonid::online {

/// Coefficients of a discrete model in powers of the difference 1 - q, q = z^-1, instead of powers of q:
///
///   A = (1-q)^n + sum_i alpha_i q (1-q)^{n-i}        B = sum_i beta_i q (1-q)^{n-i}        i = 1 ... n
///
/// The same polynomials, a_0 = 1 included, so least squares has the same solution; but far below the sample
/// rate alpha_i ~ (w Ts)^i instead of binomial numbers that cancel, and a free integrator is alpha_n = 0.
/// Stands first: beta, then alpha.
template <class Real, std::size_t Order>
struct DifferenceModel {
  std::array<Real, Order> beta{}, alpha{};  ///< [i - 1]

  [[nodiscard]] DiscreteModel<Real, Order> model() const noexcept {
    DiscreteModel<Real, Order> m;
    Real sign(1);
    for (std::size_t j = 0; j < Order; ++j) {
      sign = -sign;
      m.a[j] = sign * binomial(Order, j + 1);
    }
    for (std::size_t i = 0; i < Order; ++i) {
      for (std::size_t j = 0; j < Order; ++j) {
        m.b[j] += power(i, j) * beta[i];
        m.a[j] += power(i, j) * alpha[i];
      }
    }
    return m;
  }
  /// Coefficient of q^{j+1} in q (1-q)^{n-1-i}.
  static Real power(std::size_t i, std::size_t j) noexcept {
    const std::size_t n = Order - 1 - i;
    return j > n ? Real(0) : (j % 2 == 0 ? Real(1) : Real(-1)) * binomial(n, j);
  }
  static Real binomial(std::size_t n, std::size_t k) noexcept {
    Real value(1);
    for (std::size_t i = 0; i < k; ++i) value *= Real(n - i) / Real(i + 1);
    return value;
  }
};

/// A frequency as the fits see it: the polynomials above at z = e^{jw}, and the rows of A G - B = 0 (Levy
/// 1959; the second row of Nevaranta 2016, eq. 3.19, is mended).
template <class Real, std::size_t Order>
class LineRows {
 public:
  using Complex = std::complex<Real>;
  static constexpr std::size_t kColumns = 2 * Order;  ///< beta, alpha
  using Row = std::array<Real, kColumns>;
  struct Pair {
    Row real{}, imag{};
    Complex right;
  };

  LineRows() = default;
  explicit LineRows(double cycles_per_sample) noexcept {
    const double half = 0.5 * kTwoPi * cycles_per_sample;
    const std::complex<double> difference =
        2.0 * std::sin(half) * std::complex<double>(std::sin(half), std::cos(half));
    std::complex<double> value = std::polar(1.0, -2.0 * half);
    for (std::size_t i = Order; i-- > 0; value *= difference) power_[i] = Complex(value);
    std::complex<double> lead = 1.0;
    for (std::size_t i = 0; i < Order; ++i) lead *= difference;
    lead_ = Complex(lead);
    difference_ = static_cast<Real>(std::abs(difference));
  }

  /// lead G = sum beta_i p_i - sum alpha_i p_i G
  [[nodiscard]] Pair rows(Complex g) const noexcept {
    Pair pair;
    for (std::size_t i = 0; i < Order; ++i) {
      const Complex p = power_[i];
      const Complex pg = product(p, g);
      pair.real[i] = p.real();
      pair.imag[i] = p.imag();
      pair.real[Order + i] = -pg.real();
      pair.imag[Order + i] = -pg.imag();
    }
    pair.right = product(lead_, g);
    return pair;
  }
  [[nodiscard]] Complex numerator(const DifferenceModel<Real, Order>& m) const noexcept {
    return sum(m.beta);
  }
  [[nodiscard]] Complex denominator(const DifferenceModel<Real, Order>& m) const noexcept {
    return lead_ + sum(m.alpha);
  }
  /// |A|^2, not below what a damping ratio of 0.0005 leaves at the resonance: an estimate whose poles lie on
  /// a line must not give that line all of the weight.
  [[nodiscard]] Real power(const DifferenceModel<Real, Order>& m) const noexcept {
    constexpr Real kFloor = static_cast<Real>(1e-6);
    return std::max(std::norm(denominator(m)), kFloor * std::norm(lead_));
  }
  [[nodiscard]] Real difference() const noexcept { return difference_; }  ///< |1 - q|

 private:
  static Complex product(Complex x, Complex y) noexcept {
    return {x.real() * y.real() - x.imag() * y.imag(), x.real() * y.imag() + x.imag() * y.real()};
  }
  [[nodiscard]] Complex sum(const std::array<Real, Order>& c) const noexcept {
    Complex total{};
    for (std::size_t i = 0; i < Order; ++i) total += c[i] * power_[i];
    return total;
  }

  std::array<Complex, Order> power_{};  // q (1-q)^{n-i}
  Complex lead_{};                      // (1-q)^n
  Real difference_{};
};

/// Covariance of [beta, alpha] to that of [b, a].
template <class Real, std::size_t Order>
[[nodiscard]] ModelCovariance<Real, Order> model_covariance(
    const ModelCovariance<Real, Order>& difference) noexcept {
  constexpr int kHalf = static_cast<int>(Order);
  ModelCovariance<Real, Order> map = ModelCovariance<Real, Order>::Zero();
  for (std::size_t i = 0; i < Order; ++i) {
    for (std::size_t j = 0; j < Order; ++j) {
      const Real c = DifferenceModel<Real, Order>::power(i, j);
      map(int(j), int(i)) = c;
      map(kHalf + int(j), kHalf + int(i)) = c;
    }
  }
  return map * difference * map.transpose();
}

}  // namespace resonid::online
