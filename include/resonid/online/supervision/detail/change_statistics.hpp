// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/online/supervision/detail/learned_baseline.hpp>

namespace resonid::online {

/// Mean number of observations until a one-sided CUSUM of independent standard normal ones, moved by `shift`,
/// first passes `threshold`, from zero:
///
///   (exp(-2 d b) + 2 d b - 1) / (2 d^2),   d = shift - reference,  b = threshold + 1.166
///
/// Source: Siegmund 1985, Sequential Analysis, 2.6; within a few percent for references up to 1.
[[nodiscard]] inline double cusum_run_length(double shift, double reference, double threshold) noexcept {
  const double d = shift - reference;
  const double b = threshold + 1.166;
  if (std::abs(d) < 1e-6) return b * b;
  return (std::expm1(-2.0 * d * b) + 2.0 * d * b) / (2.0 * d * d);
}

/// The threshold at which a two-sided CUSUM of undisturbed observations gives a false alarm every
/// `run_length` observations in the mean.
[[nodiscard]] inline double cusum_threshold(double reference, double run_length) noexcept {
  double low = 0.0, high = 1.0;
  while (0.5 * cusum_run_length(0.0, reference, high) < run_length && high < 1e4) high *= 2.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * cusum_run_length(0.0, reference, middle) < run_length ? low : high) = middle;
  }
  return high;
}

/// The same for the generalised likelihood ratio max_w |S(n) - S(n-w)|/sqrt(w), w = 1 ... `window`:
///
///   run length = sqrt(8 pi) exp(c^2/2) / ( c^3 sum_w nu(c/sqrt w)^2 / w^2 )
///
/// nu(x) = (2/x) (Phi(x/2) - 1/2) / ((x/2) Phi(x/2) + phi(x/2)). Source: Siegmund and Venkatraman 1995,
/// Annals of Statistics 23, 255, with the sum in place of its integral; within a tenth for run lengths above
/// some hundred.
[[nodiscard]] inline double likelihood_ratio_run_length(double threshold, std::size_t window) noexcept {
  const auto nu = [](double x) {
    const double half = 0.5 * x;
    const double inner = 0.5 * std::erf(half / std::sqrt(2.0));  // Phi - 1/2
    const double density = std::exp(-0.5 * half * half) / std::sqrt(kTwoPi);
    return x < 1e-6 ? 1.0 : 2.0 / x * inner / (half * (inner + 0.5) + density);
  };
  double sum = 0.0;
  for (std::size_t w = 1; w <= window; ++w) {
    const double size = static_cast<double>(w);
    const double overshoot = nu(threshold / std::sqrt(size));
    sum += overshoot * overshoot / (size * size);
  }
  return std::sqrt(4.0 * kTwoPi) * std::exp(0.5 * threshold * threshold) /
         (threshold * threshold * threshold * sum);
}

[[nodiscard]] inline double likelihood_ratio_threshold(std::size_t window, double run_length) noexcept {
  double low = 0.5, high = 40.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (likelihood_ratio_run_length(middle, window) < run_length ? low : high) = middle;
  }
  return high;
}

/// How well the level and spread are known that made observations standard normal ones.
struct Certainty {
  double shared = 0.0;   ///< Variance of the level's error, in variances of an observation; 0: known.
  double degrees = 1e9;  ///< Degrees of freedom of the spread.
};

/// Where a statistic stands after an observation.
struct ChangeStatisticState {
  double level = 0.0;       ///< Over the threshold 1 it is an alarm.
  std::uint32_t since = 0;  ///< Observations since the most likely time of change, this one included.
};

/// Two-sided CUSUM: g+ = max(0, g+ + x - k), g- = max(0, g- - x - k), alarm above h. Optimal for a step of
/// 2k, with x standard normal before it.
class Cusum {
 public:
  Cusum() = default;
  Cusum(double reference, double threshold) noexcept : reference_(reference), threshold_(threshold) {}

  ChangeStatisticState step(double x, const Certainty& known = {}) noexcept {
    constexpr double kOneSided95 = 1.645;
    const double scale = 1.0 / (1.0 + kOneSided95 / std::sqrt(2.0 * known.degrees));
    const double reference = reference_ + kOneSided95 * std::sqrt(known.shared);
    up_ = next(up_, scale * x - reference);
    down_ = next(down_, -scale * x - reference);
    const Side& higher = up_.sum > down_.sum ? up_ : down_;
    return {higher.sum / threshold_, higher.since};
  }
  void reset() noexcept { up_ = down_ = {}; }
  [[nodiscard]] double threshold() const noexcept { return threshold_; }

 private:
  struct Side {
    double sum = 0.0;
    std::uint32_t since = 0;
  };
  [[nodiscard]] static Side next(Side side, double by) noexcept {
    const double sum = side.sum + by;
    return sum > 0.0 ? Side{sum, side.since + 1} : Side{};
  }
  double reference_ = 0.5;
  double threshold_ = 1.0;
  Side up_, down_;
};

/// Generalised likelihood ratio for a step of unknown size at an unknown time within the last `window`
/// observations: max_w |S(n) - S(n-w)|/sqrt(w). Finds large changes at once and small ones as soon as the
/// window allows, without being told their size.
template <std::size_t MaxWindow>
class LikelihoodRatio {
 public:
  LikelihoodRatio() = default;
  /// `window` 1 ... MaxWindow
  LikelihoodRatio(std::size_t window, double threshold) noexcept : window_(window), threshold_(threshold) {}

  ChangeStatisticState step(double x, const Certainty& known = {}) noexcept {
    past_[next_] = x;
    next_ = (next_ + 1) % window_;
    filled_ = std::min(filled_ + 1, window_);
    ChangeStatisticState best;
    double sum = 0.0, highest = 0.0;
    std::size_t at = next_;
    for (std::size_t w = 1; w <= filled_; ++w) {
      at = (at == 0 ? window_ : at) - 1;
      sum += past_[at];
      const double size = static_cast<double>(w);
      const double squared = sum * sum / (size * (1.0 + known.shared * size));
      if (squared <= highest) continue;
      highest = squared;
      best.since = static_cast<std::uint32_t>(w);
    }
    best.level = normal_of_t(highest, known.degrees) / threshold_;
    return best;
  }
  void reset() noexcept { next_ = filled_ = 0; }
  [[nodiscard]] double threshold() const noexcept { return threshold_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return window_ >= 1 && window_ <= MaxWindow && next_ < window_ && filled_ <= window_;
  }

 private:
  std::array<double, MaxWindow> past_{};  // ring
  std::size_t window_ = 1, next_ = 0, filled_ = 0;
  double threshold_ = 1.0;
};

}  // namespace resonid::online
