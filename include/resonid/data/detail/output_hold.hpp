// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

namespace resonid::data {

/// A measured signal that is new in every n-th sample only and stays in between, as that of a drive whose
/// velocity is computed at a lower rate.
struct OutputHold {
  std::size_t samples = 1;  ///< n; 1: new in every sample.
  std::size_t first = 0;    ///< First new sample, below n.

  [[nodiscard]] bool is_new(std::size_t sample) const noexcept {
    return (sample + samples - first) % samples == 0;
  }
  /// [sample] Whether the value is an old one; empty where there is no hold.
  [[nodiscard]] std::vector<bool> stale(std::size_t count) const;
  /// What the hold makes of a line below half the rate of the new values: the mean over 0 ... n-1 samples of
  /// delay.
  [[nodiscard]] std::complex<double> response(double frequency_hz, double sample_time_s) const;
};

/// By the pattern in which the values change, of n = 2 ... 64: at nearly every n-th sample, and nowhere else.
[[nodiscard]] OutputHold output_hold(std::span<const double> output);

}  // namespace resonid::data
