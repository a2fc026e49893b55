// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace resonid::diagnostics {

/// What a figure does while nothing changes, learned from itself: mean, spread and correlation from one value
/// to the next. Each new value becomes a standard normal one, independent of those before, as long as the
/// figure goes on as it did.
///
///   x(n) = c + phi x(n-1) + e(n),   e(n) of variance s^2/p(n)
///
/// c and phi by weighted recursive least squares, p(n) the value's precision. The innovation is divided by
/// what all that is known before it makes of its spread, the uncertainty of c, phi and s included (recursive
/// residuals, Brown, Durbin and Evans 1975; Hawkins 1987): so a short baseline costs no false alarms, it
/// makes the first values speak less. Limits: correlation beyond one value, tails heavier than normal ones.
class LearnedBaseline {
 public:
  /// The next value, standardised; 0 until there are 6.
  double step(double value, double precision) noexcept {
    if (values_ == 0) reference_ = value;
    const double x = value - reference_;
    double standard = 0.0;
    if (values_ > 0) standard = learn(x, last_, precision);
    last_ = x;
    ++values_;
    weight_ += precision;
    mean_ += precision / weight_ * (x - mean_);
    return standard;
  }

  [[nodiscard]] std::uint64_t values() const noexcept { return values_; }
  [[nodiscard]] double mean() const noexcept { return reference_ + mean_; }
  /// Standard deviation of the mean of values of this total precision, their correlation included.
  [[nodiscard]] double mean_std(double precision) const noexcept {
    if (degrees_ <= 0.0 || precision <= 0.0) return 0.0;
    return std::sqrt(squares_ / degrees_ / precision) / std::max(0.05, 1.0 - phi());
  }
  [[nodiscard]] double total_precision() const noexcept { return weight_; }
  /// Correlation from one value to the next, as learned.
  [[nodiscard]] double phi() const noexcept {
    return last_last_ > 0.0 ? std::clamp(last_x_ / last_last_, -0.95, 0.95) : 0.0;
  }
  /// Correlation that is left from one standardised value to the next, 0 where all of it is learned.
  [[nodiscard]] double left_over() const noexcept {
    return squares_std_ > 0.0 ? products_ / squares_std_ : 0.0;
  }

 private:
  /// One equation x = c + phi last; returns the standardised innovation. Weighted least squares by its
  /// moments.
  double learn(double x, double last, double precision) noexcept {
    double standard = 0.0;
    if (equations_ >= 2 && last_last_ > 0.0) {
      // Least squares finds too little correlation in few values, by (1 + 3 phi)/n (Kendall 1954).
      const double found = last_x_ / last_last_;
      const double slope =
          std::clamp(found + (1.0 + 3.0 * found) / static_cast<double>(equations_ + 3), -0.95, 0.95);
      const double innovation = x - mean_x_ - slope * (last - mean_last_);
      const double spread =
          1.0 / precision + 1.0 / equations_weight_ + (last - mean_last_) * (last - mean_last_) / last_last_;
      const double squared = innovation * innovation / spread;
      constexpr double kLeast = 2.0;
      if (degrees_ >= kLeast && squares_ > 0.0)
        standard = std::copysign(normal_of_t(squared / (squares_ / degrees_), degrees_), innovation);
      squares_ += squared;
      degrees_ += 1.0;
    }
    ++equations_;
    equations_weight_ += precision;
    const double share = precision / equations_weight_;
    const double from_last = last - mean_last_, from_x = x - mean_x_;
    mean_last_ += share * from_last;
    mean_x_ += share * from_x;
    last_last_ += precision * from_last * (last - mean_last_);
    last_x_ += precision * from_last * (x - mean_x_);
    products_ += standard * last_standard_;
    squares_std_ += standard * standard;
    last_standard_ = standard;
    return standard;
  }

  /// Student's t of so many degrees of freedom, given squared, as the normal value of the same probability
  /// (Wallace 1959; error below 0.01 from 4 degrees on).
  static double normal_of_t(double t_squared, double degrees) noexcept {
    return (8.0 * degrees + 1.0) / (8.0 * degrees + 3.0) *
           std::sqrt(degrees * std::log1p(t_squared / degrees));
  }

  double reference_ = 0.0;  // the first value: differences to it keep their digits
  double last_ = 0.0;
  double equations_weight_ = 0.0, mean_last_ = 0.0, mean_x_ = 0.0;
  double last_last_ = 0.0, last_x_ = 0.0;  // weighted, about the means
  double squares_ = 0.0, degrees_ = 0.0;
  double weight_ = 0.0, mean_ = 0.0;
  double last_standard_ = 0.0, products_ = 0.0, squares_std_ = 0.0;
  std::uint64_t values_ = 0, equations_ = 0;
};

}  // namespace resonid::diagnostics
