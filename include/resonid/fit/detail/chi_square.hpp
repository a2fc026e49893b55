// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::fit {

/// Probability that a chi-square variable of so many degrees of freedom exceeds x; 1 without degrees. By the
/// recurrence of the incomplete gamma function,
///   Q(a + 1, z) = Q(a, z) + z^a e^-z / Gamma(a + 1),  a = degrees/2,  z = x/2,
/// from Q(1/2, z) = erfc(sqrt z) or Q(1, z) = e^-z.
[[nodiscard]] double chi_square_tail(double x, std::size_t degrees);

}  // namespace resonid::fit
