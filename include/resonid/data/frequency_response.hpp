// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace resonid::data {

/// Measured or computed frequency response at discrete frequencies, in ascending order.
struct FrequencyResponse {
  std::vector<double> frequency_hz;         ///< [line]
  std::vector<std::complex<double>> value;  ///< [line], output unit per input unit
  std::vector<double> standard_deviation;   ///< [line], total: std^2 = E|error|^2; empty when unknown
  std::vector<double> coherence;            ///< [line], 0 ... 1; empty when unknown
  std::vector<double> unsettled_hz;         ///< lines whose tracker had not settled when the record ended

  [[nodiscard]] std::size_t lines() const noexcept { return frequency_hz.size(); }

  /// Value at any frequency inside the band, linear between the lines in re and im. Outside: the nearest
  /// line.
  [[nodiscard]] std::complex<double> at(double frequency_hz) const;

  /// The lines with `low_hz <= f <= high_hz`.
  [[nodiscard]] FrequencyResponse band(double low_hz, double high_hz) const;
};

/// Radius of the circle around a value that holds the truth with probability `confidence`, for circular
/// complex Gaussian errors of total standard deviation `standard_deviation`.
[[nodiscard]] double confidence_radius(double standard_deviation, double confidence);

}  // namespace resonid::data
