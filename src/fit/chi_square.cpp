// SPDX-License-Identifier: MIT
#include <cmath>
#include <fit/chi_square.hpp>

namespace resonid::fit::detail {

double chi_square_tail(double x, int degrees) {
  // Q(a, z) by Q(a + 1, z) = Q(a, z) + z^a e^-z / Gamma(a + 1), from Q(1/2) = erfc(sqrt z) or Q(1) = e^-z.
  if (degrees < 1 || !(x > 0.0)) return 1.0;
  const double z = 0.5 * x;
  const bool odd = degrees % 2 != 0;
  double a = odd ? 0.5 : 1.0;
  double sum = odd ? std::erfc(std::sqrt(z)) : std::exp(-z);
  for (; a < 0.5 * degrees - 0.25; a += 1.0) sum += std::exp(a * std::log(z) - z - std::lgamma(a + 1.0));
  return std::fmin(1.0, sum);
}

}  // namespace resonid::fit::detail
