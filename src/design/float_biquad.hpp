// SPDX-License-Identifier: MIT
#pragma once

#include "design/controller.hpp"

namespace resonid::design {

/// A biquad whose coefficients are rounded to floats: far below the sample rate they say little of it
/// (docs/methods/tune.md 16.4).
struct FloatBiquad {
  double largest_error = 0.0;  ///< Relative error of its response, at any frequency.
  double dc_gain_error = 0.0;
  bool stable = true;
};
[[nodiscard]] FloatBiquad float_biquad(const Biquad& biquad, double sample_time_s);

/// Up to this error a biquad is given away in floats: reached near f/fs = 1e-3.
inline constexpr double kLargestFloatError = 0.01;

}  // namespace resonid::design
