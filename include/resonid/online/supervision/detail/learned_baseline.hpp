// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace resonid::online {

/// What a figure does while nothing changes, learned from itself: level, spread and correlation with the
/// value before.
///
///   x(n) = c + phi x(n-1) + e(n),   e(n) of variance s^2/p(n)
///
/// Where n - 1 values between two are missing, the later one follows with phi^n and e of the variance
/// s^2/p (1 - phi^2n)/(1 - phi^2), and the two are nothing to learn phi from.
///
/// c and phi by weighted least squares, p(n) the value's precision. It also tells how well it knows them, so
/// that a short baseline need not cost false alarms: `shared()` is the variance of the level's error over
/// s^2, `degrees()` are the degrees of freedom with which the long-run spread s/(1 - phi) is known,
///
///   2/degrees = 2/(pairs - 2) + 4 var(phi)/(1 - phi)^2
class LearnedBaseline {
 public:
  /// @param distance from the value before, in values: 1 where none is missing
  void learn(double value, double precision, double distance = 1.0) noexcept {
    if (values_ == 0) reference_ = value;
    const double x = value - reference_;
    if (values_ > 0 && distance < kNext) add(x, last_, precision);
    last_ = x;
    ++values_;
    weight_ += precision;
    mean_ += precision / weight_ * (x - mean_);
  }

  /// Innovation of a value that follows `previous` at this distance, in standard deviations; 0 until
  /// something is learned.
  [[nodiscard]] double standardised(double value, double previous, double precision,
                                    double distance = 1.0) const noexcept {
    double s = innovation_std(), phi = memory();
    if (!(s > 0.0)) return 0.0;
    if (distance > kNext) {
      const double far =
          phi > 0.0 ? std::exp(distance * std::log(phi)) : 0.0;  // a sign that alternates is not known so far
      s *= std::sqrt((1.0 - far * far) / (1.0 - phi * phi));
      phi = far;
    }
    const double expected = mean_x_ + phi * (previous - reference_ - mean_last_);
    return (value - reference_ - expected) * std::sqrt(precision) / s;
  }

  [[nodiscard]] std::uint64_t values() const noexcept { return values_; }
  [[nodiscard]] double mean() const noexcept { return reference_ + mean_; }
  [[nodiscard]] double total_precision() const noexcept { return weight_; }
  [[nodiscard]] double memory() const noexcept {  ///< phi
    return last_last_ > 0.0 ? std::clamp(last_x_ / last_last_, -0.9, 0.9) : 0.0;
  }
  /// Standard deviation of what is new in a value of precision 1.
  [[nodiscard]] double innovation_std() const noexcept {
    if (pairs_ < 4) return 0.0;
    return std::sqrt(std::max(0.0, x_x_ - memory() * last_x_) / (static_cast<double>(pairs_) - 2.0));
  }
  /// Standard deviation of the mean of many values of this total precision, their correlation included.
  [[nodiscard]] double mean_std(double precision) const noexcept {
    return precision > 0.0 ? innovation_std() / std::sqrt(precision) / (1.0 - memory()) : 0.0;
  }
  [[nodiscard]] double shared() const noexcept {
    return pairs_ > 0 ? 1.0 / static_cast<double>(pairs_) : 1.0;
  }
  [[nodiscard]] double degrees() const noexcept {
    if (pairs_ < 4 || !(last_last_ > 0.0)) return 1.0;
    const double s = innovation_std(), rest = 1.0 - memory();
    return 2.0 / (2.0 / (static_cast<double>(pairs_) - 2.0) + 4.0 * s * s / last_last_ / (rest * rest));
  }

 private:
  static constexpr double kNext = 1.5;  // nearer: the value right before

  void add(double x, double last, double precision) noexcept {
    ++pairs_;
    equations_weight_ += precision;
    const double share = precision / equations_weight_;
    const double from_last = last - mean_last_, from_x = x - mean_x_;
    mean_last_ += share * from_last;
    mean_x_ += share * from_x;
    last_last_ += precision * from_last * (last - mean_last_);
    last_x_ += precision * from_last * (x - mean_x_);
    x_x_ += precision * from_x * (x - mean_x_);
  }

  double reference_ = 0.0;  // the first value: differences to it keep their digits
  double last_ = 0.0;
  double weight_ = 0.0, mean_ = 0.0;
  double equations_weight_ = 0.0, mean_last_ = 0.0, mean_x_ = 0.0;
  double last_last_ = 0.0, last_x_ = 0.0, x_x_ = 0.0;  // weighted, about the means
  std::uint64_t values_ = 0;
  std::uint64_t pairs_ = 0;  // of neighbours among them
};

}  // namespace resonid::online
