// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace resonid::io {

/// Most of what is put back on its grid: isolated losses of a recorder, not a part that was never recorded.
inline constexpr double kMostFilled = 0.01;       ///< Share of all samples.
inline constexpr std::size_t kLongestFilled = 3;  ///< Samples in a row.

/// Signal on a complete grid: `values` at the places `at` (ascending, 0 ... samples - 1); at all others the
/// cubic through the two nearest values on either side. At the ends the nearest value.
[[nodiscard]] std::vector<double> interpolated(std::span<const double> values,
                                               std::span<const std::size_t> at, std::size_t samples);

/// Longest run of consecutive numbers.
[[nodiscard]] std::size_t longest_run(std::span<const std::size_t> ascending);

}  // namespace resonid::io
