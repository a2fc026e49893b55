// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace resonid::response {

/// Power of a signal over frequency: averaged periodograms of Hann-windowed half-overlapping segments, mean
/// removed, scaled so that the sum over the lines is the mean square.
struct PowerSpectrum {
  std::vector<double> frequency_hz;  ///< [line], 0 ... half the sample rate.
  std::vector<double> power;         ///< [line], in the signal's unit squared.

  /// Sum over low_hz <= f < high_hz.
  [[nodiscard]] double between(double low_hz, double high_hz) const;
};

/// Segments of default_segment() samples (welch.hpp), of all samples where there are fewer than 64.
[[nodiscard]] PowerSpectrum power_spectrum(std::span<const double> signal, double sample_rate_hz);

}  // namespace resonid::response
