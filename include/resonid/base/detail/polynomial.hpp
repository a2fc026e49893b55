// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <optional>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/unrolled.hpp>

namespace resonid {

/// c_0 + c_1 x + c_2 x^2 + ... by Horner's rule; x = z^-1 for the numerator or the denominator of a
/// TransferFunction.
template <class Coefficients, class X>
[[nodiscard]] X polynomial(const Coefficients& c, X x) noexcept {
  X sum(0.0);
  for (std::size_t i = c.size(); i-- > 0;) sum = sum * x + c[i];
  return sum;
}

/// Monic polynomial z^n + c_1 z^(n-1) + ... + c_n, as the denominators and, divided by b_1, the numerators of
/// a DiscreteModel are.
template <std::size_t N>
using Monic = std::array<double, N>;

template <std::size_t N>
using Roots = std::array<std::complex<double>, N>;

namespace detail {

/// A step of Schur and Cohn's test, which takes p_0 z^n + ... + p_n to degree n - 1; false: a root lies
/// outside, or on the circle. p_0 stays positive, but shrinks to (p_0^2 - p_n^2).
template <class Real, std::size_t Size>
[[gnu::always_inline]] inline bool schur_cohn_step(std::array<Real, Size>& p, std::size_t n) noexcept {
  const Real first = p[0], last = p[n];
  if (!(std::abs(last) < first)) return false;
  for (std::size_t i = 1, j = n - 1; i <= j; ++i, --j) {
    const Real low = p[i], high = p[j];
    p[i] = first * low - last * high;
    p[j] = first * high - last * low;
  }
  p[0] = first * first - last * last;
  return true;
}

}  // namespace detail

/// Whether z^n + p_1 z^(n-1) + ... + p_n has all roots within the unit circle (Schur and Cohn's test, no root
/// is computed); p_0 is not looked at.
template <class Real, std::size_t Size>
[[nodiscard]] bool roots_inside(std::array<Real, Size> p, std::size_t degree) noexcept {
  constexpr Real kSmall = Real(1e-8);  // a division at every step would take most of the time
  p[0] = Real(1);
  for (std::size_t n = degree; n > 0; --n) {
    if (!detail::schur_cohn_step(p, n)) return false;
    if (p[0] >= kSmall) continue;
    for (std::size_t i = 1; i < n; ++i) p[i] /= p[0];
    p[0] = Real(1);
  }
  return true;
}

/// Whether all roots of a short polynomial lie within |z| < radius.
template <class Real, std::size_t N>
[[nodiscard]] bool roots_within(const std::array<Real, N>& monic, Real radius) noexcept {
  std::array<Real, N + 1> c;
  c[0] = Real(1);
  Real shrink = Real(1) / radius, scale = shrink;
  for (std::size_t i = 0; i < N; ++i, scale *= shrink) c[i + 1] = monic[i] * scale;
  bool inside = true;
  unrolled<N>([&](auto i) { inside = inside && detail::schur_cohn_step(c, N - i); });
  return inside;
}

/// Value and derivatives of c_0 z^n + c_1 z^(n-1) + ... + c_n; c_0 = 1: monic, 0: the numerator of a
/// DiscreteModel.
template <std::size_t Derivatives, std::size_t N>
[[nodiscard]] std::array<std::complex<double>, Derivatives + 1> with_derivatives(
    double c0, const Monic<N>& c, std::complex<double> z) noexcept {
  std::array<std::complex<double>, Derivatives + 1> sum{};
  sum[0] = c0;
  for (const double x : c) {
    for (std::size_t d = Derivatives; d > 0; --d) sum[d] = sum[d] * z + static_cast<double>(d) * sum[d - 1];
    sum[0] = sum[0] * z + x;
  }
  return sum;
}

template <std::size_t N>
[[nodiscard]] std::complex<double> monic_value(const Monic<N>& c, std::complex<double> z) noexcept {
  return with_derivatives<0>(1.0, c, z)[0];
}
template <std::size_t N>
[[nodiscard]] std::complex<double> monic_slope(const Monic<N>& c, std::complex<double> z) noexcept {
  return with_derivatives<1>(1.0, c, z)[1];
}

namespace detail {

inline Roots<2> quadratic_roots(double c1, double c2) noexcept {
  const double half = -0.5 * c1, square = half * half - c2;
  if (square < 0.0) {
    const double imag = std::sqrt(-square);
    return {{{half, imag}, {half, -imag}}};
  }
  const double far = half + std::copysign(std::sqrt(square), half);
  return {{{far, 0.0}, {far != 0.0 ? c2 / far : 0.0, 0.0}}};
}

/// Whether what an iteration still changes is rounding: it has converged and shrinks no more. Waiting for
/// less would be waiting for luck, a hundred passes at times, which no servo thread can spare.
inline bool only_rounds(double step, double last_step) noexcept {
  return step < 1e-9 && step >= 0.5 * last_step;
}

/// A real root by Newton's method from z = 1, near which an integrator's is; none when it does not settle.
inline std::optional<double> real_root_near_one(const Monic<3>& c) noexcept {
  double x = 1.0, last = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 12; ++i) {
    const double f = ((x + c[0]) * x + c[1]) * x + c[2];
    const double d = (3.0 * x + 2.0 * c[0]) * x + c[1];
    const double step = f / d;
    x -= step;
    if (!(std::abs(x) < 1e6)) return std::nullopt;
    const double size = std::abs(step) / (1.0 + std::abs(x));
    if (size <= 4e-16 || only_rounds(size, last)) return x;
    last = size;
  }
  return std::nullopt;
}

/// All roots at once (Aberth and Ehrlich).
template <std::size_t N>
Roots<N> aberth_roots(const Monic<N>& c) noexcept {
  double bound = 0.0;
  for (const double x : c) bound = std::max(bound, std::abs(x));
  Roots<N> z;
  for (std::size_t i = 0; i < N; ++i)
    z[i] = std::polar(std::min(1.0, 0.5 * (1.0 + bound)),
                      kTwoPi * static_cast<double>(i) / static_cast<double>(N) + 0.4);
  double last = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < 200; ++pass) {
    double largest = 0.0;
    for (std::size_t i = 0; i < N; ++i) {
      const auto f = monic_value(c, z[i]);
      if (f == 0.0) continue;
      std::complex<double> repelled = monic_slope(c, z[i]) / f;
      for (std::size_t j = 0; j < N; ++j)
        if (j != i && z[j] != z[i]) repelled -= 1.0 / (z[i] - z[j]);
      if (repelled == 0.0) continue;
      const auto step = 1.0 / repelled;
      z[i] -= step;
      largest = std::max(largest, std::abs(step) / (1.0 + std::abs(z[i])));
    }
    if (largest < 4e-16 || only_rounds(largest, last)) break;
    last = largest;
  }
  return z;
}

}  // namespace detail

/// Roots; those of a conjugate pair stand beside each other, the one with positive imaginary part first.
template <std::size_t N>
[[nodiscard]] Roots<N> roots(const Monic<N>& c) noexcept {
  if constexpr (N == 0) return {};
  if constexpr (N == 1) return {{{-c[0], 0.0}}};
  if constexpr (N == 2) return detail::quadratic_roots(c[0], c[1]);
  if constexpr (N == 3) {
    if (const auto x = detail::real_root_near_one(c)) {
      const double c1 = c[0] + *x;
      const auto pair = detail::quadratic_roots(c1, c[1] + *x * c1);
      return {{{*x, 0.0}, pair[0], pair[1]}};
    }
  }
  if constexpr (N >= 3) {
    Roots<N> z = detail::aberth_roots(c);
    // A root whose conjugate is not among them is real; rounding decides nothing.
    for (std::size_t i = 0; i < N; ++i) {
      std::size_t mirror = i;
      for (std::size_t j = i; j < N; ++j)
        if (std::abs(z[j] - std::conj(z[i])) < std::abs(z[mirror] - std::conj(z[i]))) mirror = j;
      if (mirror == i) {
        z[i] = z[i].real();
        continue;
      }
      const std::complex<double> middle(0.5 * (z[i].real() + z[mirror].real()),
                                        0.5 * std::abs(z[i].imag() - z[mirror].imag()));
      z[mirror] = z[i + 1];
      z[i] = middle;
      z[i + 1] = std::conj(middle);
      ++i;
    }
    return z;
  }
}

/// The polynomial with these roots.
template <std::size_t N>
[[nodiscard]] Monic<N> from_roots(const Roots<N>& z) noexcept {
  std::array<std::complex<double>, N + 1> c{};
  c[0] = 1.0;
  for (std::size_t i = 0; i < N; ++i)
    for (std::size_t j = i + 1; j > 0; --j) c[j] -= z[i] * c[j - 1];
  Monic<N> monic;
  for (std::size_t i = 0; i < N; ++i) monic[i] = c[i + 1].real();
  return monic;
}

}  // namespace resonid
