// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <span>
#include <vector>

namespace resonid {

/// Middle of the values, the upper one of an even number; 0 of none. Leaves them in another order.
[[nodiscard]] inline double median_in_place(std::span<double> values) noexcept {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}
[[nodiscard]] inline double median(std::vector<double> values) { return median_in_place(values); }

/// Interpolated between ordered values, at least one; probability 0 ... 1 from the first to the last.
[[nodiscard]] inline double ordered_quantile(std::span<const double> ordered, double probability) {
  const double at = probability * static_cast<double>(ordered.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, ordered.size() - 1);
  return ordered[below] + (at - static_cast<double>(below)) * (ordered[above] - ordered[below]);
}

/// Not a number of none.
[[nodiscard]] inline double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}
/// Sum of the squared distances from the mean; over n the variance, over n - 1 one that is not biased.
[[nodiscard]] inline double squares_about_mean(std::span<const double> values) {
  const double centre = mean(values);
  double sum = 0.0;
  for (const double v : values) sum += (v - centre) * (v - centre);
  return sum;
}
[[nodiscard]] inline double variance(std::span<const double> values) {
  return squares_about_mean(values) / static_cast<double>(values.size());
}
[[nodiscard]] inline double deviation(std::span<const double> values) { return std::sqrt(variance(values)); }
[[nodiscard]] inline double sum_of_squares(std::span<const double> values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}
/// 0 of none.
[[nodiscard]] inline double mean_square(std::span<const double> values) {
  return sum_of_squares(values) / static_cast<double>(std::max<std::size_t>(values.size(), 1));
}
[[nodiscard]] inline double rms(std::span<const double> values) { return std::sqrt(mean_square(values)); }

/// How much of a signal a model explains, 100 (1 - |y - yh|/|y - mean y|), from the two sums of squares; 0
/// for a signal that does not move.
[[nodiscard]] inline double fit_percent_of(double left, double total) {
  return total > 0.0 ? 100.0 * (1.0 - std::sqrt(left / total)) : 0.0;
}

/// Half width of the two-sided Gaussian interval of the given confidence, in standard deviations.
[[nodiscard]] inline double two_sided_quantile(double confidence) {
  double low = 0.0, high = 10.0;
  for (int i = 0; i < 80; ++i) {
    const double middle = 0.5 * (low + high);
    (std::erf(middle / std::sqrt(2.0)) < confidence ? low : high) = middle;
  }
  return low;
}

/// Probability that a chi-square variable of so many degrees of freedom exceeds x; 1 without degrees. By the
/// recurrence of the incomplete gamma function,
///   Q(a + 1, z) = Q(a, z) + z^a e^-z / Gamma(a + 1),  a = degrees/2,  z = x/2,
/// from Q(1/2, z) = erfc(sqrt z) or Q(1, z) = e^-z.
[[nodiscard]] inline double chi_square_tail(double x, std::size_t degrees) {
  if (degrees == 0 || !(x > 0.0)) return 1.0;
  if (!std::isfinite(x)) return 0.0;
  const double z = 0.5 * x, end = 0.5 * static_cast<double>(degrees);
  const bool odd = degrees % 2 != 0;
  double sum = odd ? std::erfc(std::sqrt(z)) : std::exp(-z);
  for (double a = odd ? 0.5 : 1.0; a < end - 0.25; a += 1.0)
    sum += std::exp(a * std::log(z) - z - std::lgamma(a + 1.0));
  return std::fmin(1.0, sum);
}

/// Student's t of so many degrees of freedom, given squared, as the magnitude of the normal value of the same
/// probability (Wallace 1959; error below 0.01 from 4 degrees on).
[[nodiscard]] inline double normal_of_t(double t_squared, double degrees) noexcept {
  return (8.0 * degrees + 1.0) / (8.0 * degrees + 3.0) * std::sqrt(degrees * std::log1p(t_squared / degrees));
}

}  // namespace resonid
