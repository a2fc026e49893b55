// SPDX-License-Identifier: MIT
#pragma once

namespace resonid::fit::detail {

/// Probability that a chi-square variable of so many degrees of freedom exceeds x.
[[nodiscard]] double chi_square_tail(double x, int degrees);

}  // namespace resonid::fit::detail
