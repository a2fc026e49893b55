// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace resonid {

/// Interpolated between ordered values, at least one; probability 0 ... 1 from the first to the last.
[[nodiscard]] inline double ordered_quantile(const std::vector<double>& ordered, double probability) {
  const double at = probability * static_cast<double>(ordered.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, ordered.size() - 1);
  return ordered[below] + (at - static_cast<double>(below)) * (ordered[above] - ordered[below]);
}

}  // namespace resonid
