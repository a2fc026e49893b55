// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <span>
#include <vector>

namespace resonid::data {

/// Discrete transfer function in powers of z^-1 at a known sample time.
struct TransferFunction {
  std::vector<double> numerator;    ///< b0, b1, ...
  std::vector<double> denominator;  ///< a0 = 1, a1, ...
  double sample_time_s = 0.0;

  /// Response at a frequency; 0 Hz of an integrating system is infinite.
  [[nodiscard]] std::complex<double> response(double frequency_hz) const;

  /// Output for an input record, starting at rest.
  [[nodiscard]] std::vector<double> simulate(std::span<const double> input) const;

  /// Poles in the z-plane.
  [[nodiscard]] std::vector<std::complex<double>> poles() const;
};

/// PI controller `C(z) = gain (1 + Ts/integral_time * z/(z-1))` (backward Euler).
[[nodiscard]] TransferFunction pi_controller(double gain, double integral_time_s, double sample_time_s);

}  // namespace resonid::data
