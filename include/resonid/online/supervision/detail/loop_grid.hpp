// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace resonid::online::detail {

/// Frequencies at which the loop of a model is looked at, one after the other in ascending order: 200 evenly
/// spread over the logarithm of frequency, and 160 further ones within a factor of 1.4 of its resonance,
/// which turns the curve within a small part of its frequency.
class LoopGrid {
 public:
  static constexpr std::size_t kEven = 200, kNear = 160, kMost = kEven + kNear;

  LoopGrid() = default;
  /// `from_hz` 0: 0.0005 of the sample rate.
  LoopGrid(double sample_rate_hz, double from_hz) noexcept {
    const double nyquist = 0.5 * sample_rate_hz;
    const double from = from_hz > 0.0 ? std::min(from_hz, 0.01 * nyquist) : 0.001 * nyquist;
    from_hz_ = std::max(from, 1e-5 * nyquist);
    even_ratio_ = std::pow(0.998 * nyquist / from_hz_, 1.0 / (kEven - 1));
    near_ratio_ = std::pow(kSpan, 2.0 / (kNear - 1));
  }

  /// Frequency of one of the evenly spread points, 0 ... kEven - 1.
  [[nodiscard]] double even_hz(std::size_t i) const noexcept {
    return from_hz_ * std::pow(even_ratio_, static_cast<double>(i));
  }

  /// A resonance that is not a number, or 0, has nothing about it.
  void begin(double resonance_hz) noexcept {
    even_ = near_ = 0;
    even_hz_ = from_hz_;
    near_hz_ = resonance_hz / kSpan;
    if (!(near_hz_ > 0.0)) near_ = kNear;
    for (; near_ < kNear && near_hz_ <= from_hz_; ++near_) near_hz_ *= near_ratio_;
  }
  [[nodiscard]] bool done() const noexcept {
    return even_ == kEven;
  }  // what is near beyond the band stays out
  [[nodiscard]] double hz() const noexcept { return near_ < kNear ? std::min(even_hz_, near_hz_) : even_hz_; }
  void advance() noexcept {
    if (near_ < kNear && near_hz_ <= even_hz_) {
      near_hz_ *= near_ratio_;
      ++near_;
    } else {
      even_hz_ *= even_ratio_;
      ++even_;
    }
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return even_ <= kEven && near_ <= kNear; }

 private:
  static constexpr double kSpan = 1.4;

  double from_hz_ = 0.0;
  double even_ratio_ = 1.0, near_ratio_ = 1.0;  // from a point to the next one
  double even_hz_ = 0.0, near_hz_ = 0.0;        // that come next
  std::size_t even_ = 0, near_ = 0;             // points done
};

}  // namespace resonid::online::detail
