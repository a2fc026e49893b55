// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <resonid/data/transfer_function.hpp>
#include <span>
#include <vector>

namespace resonid::data {

/// Whether a polynomial in z^-1 is zero at z = 1 to the rounding of its coefficients.
[[nodiscard]] inline bool vanishes_at_one(std::span<const double> coefficients) {
  constexpr double kRounding = 1e-14;
  double value = 0.0, sizes = 0.0;
  for (const double term : coefficients) {
    value += term;
    sizes += std::abs(term);
  }
  return std::abs(value) <= kRounding * sizes;
}

/// By z - 1.
inline void divide_by_integrator(std::vector<double>& polynomial) {
  for (std::size_t i = 1; i < polynomial.size(); ++i) polynomial[i] += polynomial[i - 1];
  polynomial.pop_back();
}

/// Whether a denominator in z^-1 has a root at z = 1, even if its coefficients were rounded to 8 digits. That
/// leaves something there, and slow filters leave little too, n roots at a distance d the n-th power of it.
/// What is more than rounding is then a root's where one is far nearer to 1 than all others: with e1 and e2
/// the sums of 1/d and of their products in pairs, e2/e1^2 is about the nearest distance over the next, and
/// no terms cancel where all are inside of the unit circle. It is two roots' where the slope is as little as
/// the value, which of filters is the larger by the sum of 1/d.
[[nodiscard]] inline bool has_root_at_one(std::span<const double> denominator) {
  constexpr double kFewDigits = 1e-7, kFarNearer = 1e-3, kAsLittle = 30.0;
  if (vanishes_at_one(denominator)) return true;
  double value = 0.0, slope = 0.0, bend = 0.0, sizes = 0.0;  // in z, by powers that fall
  double power = static_cast<double>(denominator.size()) - 1.0;
  for (const double term : denominator) {
    value += term;
    slope += power * term;
    bend += 0.5 * power * (power - 1.0) * term;
    sizes += std::abs(term);
    power -= 1.0;
  }
  if (std::abs(value) > kFewDigits * sizes) return false;
  return std::abs(value * bend) <= kFarNearer * slope * slope ||
         std::abs(slope) <= std::min(kAsLittle * std::abs(value), kFewDigits * sizes);
}
/// Whether it integrates.
[[nodiscard]] inline bool has_pole_at_one(const TransferFunction& f) {
  return has_root_at_one(f.denominator);
}

}  // namespace resonid::data
