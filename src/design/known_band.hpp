// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <limits>

// What a model may err by above the highest frequency at which its machine was measured
// (docs/methods/tune.md 7.10).
namespace resonid::design {

inline constexpr double kKnownEverywhere = std::numeric_limits<double>::infinity();

/// 1 + rho with rho = min(1, f/known_to_hz - 1), the relative error of the response: none at the end of the
/// band, all of it an octave above. Inside the band 0, since nothing is asked there.
/// (1 + rho)|L| <= 1 keeps |T| rho <= 1 whatever the phase of L is, and every crossover inside the band.
[[nodiscard]] inline double weight_beyond(double frequency_hz, double known_to_hz) {
  if (!(frequency_hz >= known_to_hz)) return 0.0;
  return std::min(2.0, frequency_hz / known_to_hz);
}

}  // namespace resonid::design
