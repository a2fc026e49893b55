// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace resonid::design {

/// c0 + c1 x + ...
template <std::size_t Count>
[[nodiscard]] double rising_polynomial_at(const std::array<double, Count>& c, double x) {
  double sum = 0.0;
  for (std::size_t i = Count; i-- > 0;) sum = sum * x + c[i];
  return sum;
}

/// Where a polynomial changes its sign between two places, ascending: by bisection between the places at
/// which its derivative does, which misses no pair of neighbouring roots.
template <std::size_t Count>
[[nodiscard]] std::vector<double> sign_changes(const std::array<double, Count>& c, double from, double to) {
  if constexpr (Count <= 1) {
    return {};
  } else {
    std::array<double, Count - 1> slope{};
    for (std::size_t i = 1; i < Count; ++i) slope[i - 1] = static_cast<double>(i) * c[i];
    std::vector<double> places = sign_changes(slope, from, to), found;
    places.push_back(to);
    double low = from;
    for (double high : places) {
      const double next = high;
      const bool rises = rising_polynomial_at(c, low) < 0.0;
      if ((rising_polynomial_at(c, high) < 0.0) != rises) {
        while (high - low > 1e-15 * std::abs(high)) {
          const double middle = 0.5 * (low + high);
          if (middle <= low || middle >= high) break;
          ((rising_polynomial_at(c, middle) < 0.0) == rises ? low : high) = middle;
        }
        found.push_back(0.5 * (low + high));
      }
      low = next;
    }
    return found;
  }
}

/// The first place beyond 0 at which a polynomial that is not negative there becomes so; infinite where there
/// is none.
template <std::size_t Count>
[[nodiscard]] double first_sign_change(const std::array<double, Count>& c) {
  std::size_t degree = Count - 1;
  while (degree > 0 && c[degree] == 0.0) --degree;
  double largest = 0.0;  // Cauchy's bound, in a form that no scale makes overflow
  for (std::size_t i = 0; i < degree; ++i)
    largest = std::max(largest, std::pow(std::abs(c[i] / c[degree]), 1.0 / static_cast<double>(degree - i)));
  const auto found = sign_changes(c, 0.0, 2.0 * largest);
  return found.empty() ? std::numeric_limits<double>::infinity() : found.front();
}

}  // namespace resonid::design
