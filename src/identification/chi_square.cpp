// SPDX-License-Identifier: MIT
#include <cmath>
#include <identification/chi_square.hpp>

namespace resonid::identification::detail {
namespace {

constexpr int kTerms = 10000;
constexpr double kPrecision = 1e-15;

/// P(a, x), for x < a + 1.
double lower_series(double a, double x, double factor) {
  double term = 1.0 / a, sum = term;
  for (int n = 1; n < kTerms && term > kPrecision * sum; ++n) {
    term *= x / (a + n);
    sum += term;
  }
  return factor * sum;
}

/// Q(a, x), for x >= a + 1, by Lentz's method.
double upper_fraction(double a, double x, double factor) {
  constexpr double kTiny = 1e-300;
  double b = x + 1.0 - a, c = 1.0 / kTiny, d = 1.0 / b, product = d;
  for (int n = 1; n < kTerms; ++n) {
    const double numerator = -n * (n - a);
    b += 2.0;
    d = numerator * d + b;
    c = b + numerator / c;
    if (std::abs(d) < kTiny) d = kTiny;
    if (std::abs(c) < kTiny) c = kTiny;
    d = 1.0 / d;
    const double step = d * c;
    product *= step;
    if (std::abs(step - 1.0) < kPrecision) break;
  }
  return factor * product;
}

}  // namespace

double chi_square_tail(double x, std::size_t degrees) {
  if (degrees == 0 || !(x > 0.0)) return 1.0;
  if (!std::isfinite(x)) return 0.0;
  const double a = 0.5 * static_cast<double>(degrees), half = 0.5 * x;
  const double factor = std::exp(a * std::log(half) - half - std::lgamma(a));
  return half < a + 1.0 ? 1.0 - lower_series(a, half, factor) : upper_fraction(a, half, factor);
}

}  // namespace resonid::identification::detail
