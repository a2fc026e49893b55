// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <complex>
#include <cstddef>
#include <limits>
#include <span>

// Where the lines of a loop end (docs/methods/tune.md 7.7): nothing is known beyond, which any judgement by
// lines has to leave room for.
namespace resonid::design {

/// The largest |L| at the last line: beyond it the response may be anything up to twice what it would be.
inline constexpr double kLargestAtEnd = 0.5;
/// The same where |L| rises there: the lines end on the flank of a resonance, of which |L| is a small part.
inline constexpr double kLargestRising = 0.25;

struct LoopEnd {
  double size = 0.0;  ///< |L| at the last line; of a line that errs the largest within its error.
  double rise = 1.0;  ///< |L| at the last line over the least in the octave below it.

  [[nodiscard]] bool rises() const {
    constexpr double kFlat = 1.1;
    return rise > kFlat;
  }
};

/// Of a loop at ascending frequencies, whose last line errs by up to `error`.
[[nodiscard]] inline LoopEnd loop_end(std::span<const double> frequencies_hz,
                                      std::span<const std::complex<double>> loop, double error = 0.0) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < loop.size(); ++i)
    if (frequencies_hz[i] >= 0.5 * frequencies_hz.back()) least = std::min(least, std::abs(loop[i]));
  const double last = std::abs(loop.back());
  return {last + error, last / least};
}

/// Whether what the lines do not show may make the loop unstable. A thousandth more than the limit is none:
/// designs reach it, and gains are rounded.
[[nodiscard]] inline bool ends_too_large(const LoopEnd& end) {
  constexpr double kRounding = 1e-3;
  return !(end.size <= (end.rises() ? kLargestRising : (1.0 + kRounding) * kLargestAtEnd));
}

}  // namespace resonid::design
