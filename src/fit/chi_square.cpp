// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/fit/detail/chi_square.hpp>

namespace resonid::fit {

double chi_square_tail(double x, std::size_t degrees) {
  if (degrees == 0 || !(x > 0.0)) return 1.0;
  if (!std::isfinite(x)) return 0.0;
  const double z = 0.5 * x, end = 0.5 * static_cast<double>(degrees);
  const bool odd = degrees % 2 != 0;
  double sum = odd ? std::erfc(std::sqrt(z)) : std::exp(-z);
  for (double a = odd ? 0.5 : 1.0; a < end - 0.25; a += 1.0)
    sum += std::exp(a * std::log(z) - z - std::lgamma(a + 1.0));
  return std::fmin(1.0, sum);
}

}  // namespace resonid::fit
