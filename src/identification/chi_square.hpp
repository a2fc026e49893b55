// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::identification::detail {

/// Probability that a chi-square variable of so many degrees of freedom is at least x: the regularised upper
/// incomplete gamma function Q(degrees/2, x/2), by its series or continued fraction. 1 without degrees.
[[nodiscard]] double chi_square_tail(double x, std::size_t degrees);

}  // namespace resonid::identification::detail
