// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <resonid/base/detail/unrolled.hpp>

namespace resonid::online {

/// Symmetric positive semi-definite matrix P itself, one triangle of it: symmetric bit for bit, because there
/// is no other half that rounding could make differ. The same interface as UdFactors, in fewer operations.
///
/// Limit: nothing but the mathematics keeps P positive. Where its condition comes near the precision's
/// (1e7 in float, 1e16 in double), rounding can make it indefinite; UdFactors cannot become so.
template <class Real, std::size_t N>
class SymmetricCovariance {
 public:
  using Vector = std::array<Real, N>;
  using Matrix = Eigen::Matrix<Real, static_cast<int>(N), static_cast<int>(N)>;
  struct Direction {
    Vector image{};  ///< P x
    Real spread{};   ///< x' P x
  };

  /// Diagonal.
  void reset(const Vector& variance) noexcept {
    p_.fill(Real(0));
    for (std::size_t i = 0; i < N; ++i) p_[place(i, i)] = variance[i];
  }

  [[nodiscard]] Direction project(const Vector& x) const noexcept {
    Direction d;
    unrolled<N>([&](auto i) {
      d.image[i] = p_[place(i, i)] * x[i];
      unrolled<i>([&](auto j) {
        const Real p = p_[place(i, j)];
        d.image[i] += p * x[j];
        d.image[j] += p * x[i];
      });
    });
    unrolled<N>([&](auto i) { d.spread += d.image[i] * x[i]; });
    return d;
  }
  /// x' P x, and P x, of d = project(x).
  [[nodiscard]] Real spread(const Direction& d) const noexcept { return d.spread; }
  [[nodiscard]] Vector image(const Direction& d) const noexcept { return d.image; }

  /// P <- growth (P - P x x' P/(noise + x' P x)); d = project(x). A negative noise, of more than x' P x,
  /// takes information away. Returns P x of the former P.
  Vector absorb(const Direction& d, Real noise, Real growth) noexcept {
    const Real scale = growth / (noise + d.spread);
    unrolled<N>([&](auto i) {
      const Real slope = scale * d.image[i];
      unrolled<i + 1>([&](auto j) { p_[place(i, j)] = growth * p_[place(i, j)] - slope * d.image[j]; });
    });
    return d.image;
  }

  [[nodiscard]] Real variance(std::size_t i) const noexcept { return p_[place(i, i)]; }
  /// Absorbs a measurement of entry i alone, so certain that its variance falls from `from` to `to`.
  void lower(std::size_t i, Real from, Real to) noexcept {
    Vector x{};
    x[i] = Real(1);
    absorb(project(x), to * (from / (from - to)), Real(1));
    // What silence makes fade ends at 0, where it is below rounding, and not in denormal numbers.
    constexpr Real kRounding = std::numeric_limits<Real>::epsilon();
    for (std::size_t j = 0; j < N; ++j) {
      for (std::size_t l = 0; l < j; ++l) {
        Real& p = p_[place(j, l)];
        if (std::abs(p) < kRounding * std::min(variance(j), variance(l))) p = Real(0);
      }
    }
  }
  /// Adds to the variance of entry i alone.
  void raise(std::size_t i, Real amount) noexcept { p_[place(i, i)] += amount; }

  [[nodiscard]] Matrix dense() const noexcept {
    Matrix p;
    for (std::size_t i = 0; i < N; ++i)
      for (std::size_t j = 0; j < N; ++j) p(static_cast<int>(i), static_cast<int>(j)) = p_[place(i, j)];
    return p;
  }

 private:
  static constexpr std::size_t place(std::size_t i, std::size_t j) noexcept {
    return i < j ? j * (j + 1) / 2 + i : i * (i + 1) / 2 + j;
  }

  std::array<Real, N*(N + 1) / 2> p_{};  // [row (row + 1)/2 + column], column <= row
};

}  // namespace resonid::online
