// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string>

namespace resonid {

/// How many digits a value has that is known to +- half_width, which keeps two.
class ErrorDigits {
 public:
  ErrorDigits(double value, double half_width) noexcept {
    if (!(half_width > 0.0) || !std::isfinite(half_width)) return;
    constexpr double kWhole = 1e5;    // what is smaller is written out
    constexpr int kMostDecimals = 8;  // what is known better than that is a bound of the fit, not a figure
    known_ = true;
    precision_ = 1 - static_cast<int>(std::floor(std::log10(half_width)));
    if (half_width < kWhole) precision_ = std::max(precision_, 0);
    const double size = std::abs(value);
    if (precision_ >= 0 && precision_ <= kMostDecimals && !(size < 1e-3 || size >= kWhole)) return;
    fixed_ = false;
    const double digits = 2.0 + std::floor(std::log10(size / half_width));
    precision_ = digits > 2.0 ? static_cast<int>(std::min(digits, 1.0 * kMostDecimals)) : 2;
  }
  [[nodiscard]] std::string value(double x) const {
    return known_ ? written(x, fixed_, precision_) : written(x, false, 5);
  }
  /// Empty where there is none.
  [[nodiscard]] std::string half_width(double x) const {
    return known_ ? written(x, fixed_, fixed_ ? precision_ : 2) : std::string();
  }

 private:
  static std::string written(double x, bool fixed, int precision) {
    char text[400];  // the largest double in full has 309 digits
    const auto format = fixed ? std::chars_format::fixed : std::chars_format::general;
    return {text, std::to_chars(text, text + sizeof text, x, format, precision).ptr};
  }
  bool known_ = false, fixed_ = true;
  int precision_ = 0;  // decimals, or digits
};

/// "15.106 +- 0.031": as many decimals as the uncertainty has two digits.
[[nodiscard]] inline std::string with_error(double value, double half_width) {
  const ErrorDigits digits(value, half_width);
  const std::string error = digits.half_width(half_width);
  return error.empty() ? digits.value(value) : digits.value(value) + " +- " + error;
}

}  // namespace resonid
