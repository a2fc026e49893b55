// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <vector>

namespace resonid::data {

/// How alike the errors of two lines are: E{e1 e2*}/(std1 std2), real, over their distance. A smoothed
/// response has many lines and little information; a fit to it has to know (docs/methods/response_fit.md).
struct LineCorrelation {
  std::vector<double> distance_hz;  ///< Ascending, from 0 on; empty: lines are independent.
  std::vector<double> value;        ///< 1 at distance 0; taken as 0 beyond the last distance.

  /// Linear between the distances.
  [[nodiscard]] double at(double distance_hz) const;
};

/// What smoothing over frequency makes of a response: not G(f) is measured but
///
///   sum_+- G(f +- d) w(f +- d) / sum_+- w(f +- d),   w(f +- d) = w(f) exp(+-d slope)
///
/// with d the standard deviation of the smoothing kernel and w what weights it (the spectrum of the input):
/// the two-point rule that is exact to third order.
struct Smoothing {
  double width_hz = 0.0;                    ///< d; 0: none.
  std::vector<std::complex<double>> slope;  ///< [line] w'/w in 1/Hz; empty: 0.
};

/// Measured or computed frequency response at discrete frequencies, in ascending order.
struct FrequencyResponse {
  std::vector<double> frequency_hz;         ///< [line]
  std::vector<std::complex<double>> value;  ///< [line], output unit per input unit
  std::vector<double> std;                  ///< [line], total: std^2 = E|error|^2; empty when unknown
  std::vector<double> coherence;            ///< [line], 0 ... 1; empty when unknown
  std::vector<double> unsettled_hz;         ///< lines whose tracker had not settled when the record ended
  LineCorrelation correlation{};            ///< of the errors of different lines
  Smoothing smoothing{};                    ///< that the method did over frequency

  [[nodiscard]] std::size_t lines() const noexcept { return frequency_hz.size(); }

  /// Value at any frequency inside the band, linear between the lines in re and im. Outside: the nearest
  /// line.
  [[nodiscard]] std::complex<double> at(double frequency_hz) const;

  /// The lines with `low_hz <= f <= high_hz`.
  [[nodiscard]] FrequencyResponse band(double low_hz, double high_hz) const;
};

/// Radius of the circle around a value that holds the truth with probability `confidence`, for circular
/// complex Gaussian errors of total standard deviation `std`.
[[nodiscard]] double confidence_radius(double std, double confidence);

}  // namespace resonid::data
