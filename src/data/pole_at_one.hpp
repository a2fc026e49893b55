// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <resonid/data/transfer_function.hpp>
#include <span>

namespace resonid::data {

/// Whether a polynomial in z^-1 is zero at z = 1 to the rounding of its coefficients. Coefficients of fewer
/// digits leave more there, and slow filters little too, n roots at a distance d the n-th power of it. What
/// is more than rounding is then a root's where one is far nearer to 1 than all others: with e1 and e2 the
/// sums of 1/d and of their products in pairs, e2/e1^2 is about the nearest distance over the next, and no
/// terms cancel where all are inside of the unit circle.
[[nodiscard]] inline bool has_root_at_one(std::span<const double> coefficients) {
  constexpr double kRounding = 1e-14, kFewDigits = 1e-7, kFarNearer = 1e-3;
  double value = 0.0, slope = 0.0, bend = 0.0, sizes = 0.0;  // in z, by powers that fall
  double power = static_cast<double>(coefficients.size()) - 1.0;
  for (const double term : coefficients) {
    value += term;
    slope += power * term;
    bend += 0.5 * power * (power - 1.0) * term;
    sizes += std::abs(term);
    power -= 1.0;
  }
  if (std::abs(value) <= kRounding * sizes) return true;
  return std::abs(value) <= kFewDigits * sizes && std::abs(value * bend) <= kFarNearer * slope * slope;
}
/// Whether it integrates.
[[nodiscard]] inline bool has_pole_at_one(const TransferFunction& f) {
  return has_root_at_one(f.denominator);
}

}  // namespace resonid::data
