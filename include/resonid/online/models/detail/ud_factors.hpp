// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <resonid/base/detail/unrolled.hpp>

namespace resonid::online {

/// Symmetric positive semi-definite matrix P = U D U' as its factors, U unit upper triangular, D diagonal and
/// never negative: symmetric and positive by construction, whatever rounding does. A D of 0 stays 0.
/// Source: Bierman 1977, ch. V.
template <class Real, std::size_t N>
class UdFactors {
 public:
  using Vector = std::array<Real, N>;
  using Matrix = Eigen::Matrix<Real, static_cast<int>(N), static_cast<int>(N)>;
  using Direction = Vector;  ///< U' x

  /// Diagonal.
  void reset(const Vector& variance) noexcept {
    for (Vector& column : u_) column.fill(Real(0));
    d_ = variance;
  }

  /// U' x
  [[nodiscard]] Direction project(const Vector& x) const noexcept {
    Vector f;
    unrolled<N>([&](auto j) {
      Real sum = x[j];
      unrolled<j>([&](auto i) { sum += u_[j][i] * x[i]; });
      f[j] = sum;
    });
    return f;
  }
  /// x' P x, and P x, of f = project(x).
  [[nodiscard]] Real spread(const Direction& f) const noexcept {
    Real sum(0);
    unrolled<N>([&](auto j) { sum += d_[j] * f[j] * f[j]; });
    return sum;
  }
  [[nodiscard]] Vector image(const Direction& f) const noexcept {
    Vector k;
    unrolled<N>([&](auto j) {
      const Real g = d_[j] * f[j];
      k[j] = g;
      unrolled<j>([&](auto i) { k[i] += g * u_[j][i]; });
    });
    return k;
  }

  /// P <- growth (P - P x x' P/(noise + x' P x)); f = project(x). A negative noise, of more than x' P x,
  /// takes information away. Returns P x of the former P.
  Vector absorb(const Direction& f, Real noise, Real growth) noexcept {
    Vector k;
    Real alpha = noise, inverse = Real(1) / noise;
    unrolled<N>([&](auto j) {
      const Real g = d_[j] * f[j], next = alpha + f[j] * g, slope = f[j] * inverse;
      inverse = Real(1) / next;
      d_[j] *= alpha * inverse * growth;
      alpha = next;
      k[j] = g;
      unrolled<j>([&](auto i) {
        const Real u = u_[j][i];
        u_[j][i] = u - slope * k[i];
        k[i] += g * u;
      });
    });
    return k;
  }

  [[nodiscard]] Real variance(std::size_t i) const noexcept {
    Real sum = d_[i];
    for (std::size_t j = i + 1; j < N; ++j) sum += u_[j][i] * u_[j][i] * d_[j];
    return sum;
  }
  /// Absorbs a measurement of entry i alone, so certain that its variance falls from `from` to `to`.
  void lower(std::size_t i, Real from, Real to) noexcept {
    Vector x{};
    x[i] = Real(1);
    absorb(project(x), to * (from / (from - to)), Real(1));
    // What silence makes fade ends at 0, where it is below rounding, and not in denormal numbers.
    constexpr Real kRounding = std::numeric_limits<Real>::epsilon();
    for (std::size_t j = 0; j < N; ++j)
      for (std::size_t l = 0; l < j; ++l)
        if (u_[j][l] * u_[j][l] * d_[j] < kRounding * kRounding * d_[l]) u_[j][l] = Real(0);
  }
  /// Adds to the variance of entry i alone (Agee and Turner).
  void raise(std::size_t i, Real amount) noexcept {
    Vector v{};
    v[i] = Real(1);
    for (std::size_t j = i + 1; j-- > 0;) {
      const Real d = d_[j] + amount * v[j] * v[j];
      if (!(d > Real(0))) continue;
      const Real slope = amount * v[j] / d;
      for (std::size_t l = 0; l < j; ++l) {
        v[l] -= v[j] * u_[j][l];
        u_[j][l] += slope * v[l];
      }
      amount *= d_[j] / d;
      d_[j] = d;
    }
  }

  [[nodiscard]] Matrix dense() const noexcept {
    Matrix p = Matrix::Zero();
    for (std::size_t j = 0; j < N; ++j)
      for (std::size_t i = 0; i <= j; ++i)
        for (std::size_t l = 0; l <= i; ++l)
          p(static_cast<int>(i), static_cast<int>(l)) +=
              (i == j ? Real(1) : u_[j][i]) * d_[j] * (l == j ? Real(1) : u_[j][l]);
    for (int i = 0; i < static_cast<int>(N); ++i)
      for (int l = 0; l < i; ++l) p(l, i) = p(i, l);
    return p;
  }

 private:
  std::array<Vector, N> u_{};  // [column][row], the entries above the diagonal
  Vector d_{};
};

}  // namespace resonid::online
