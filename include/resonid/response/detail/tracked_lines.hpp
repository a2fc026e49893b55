// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

enum class LineMethod {
  kalman,         ///< Bank of oscillators with one innovation.
  sliding_dft,    ///< Sliding DFT over one window.
  least_squares,  ///< All lines and a constant at once over the whole range.
};

struct TrackedLinesConfig {
  std::vector<double> lines_hz;  ///< Lines of the excitation, 1 ... 256, each in (0, half the sample rate).
  LineMethod method = LineMethod::kalman;
  double lambda = 0.0;  ///< Bank with the published gain, > 0; 0: poles placed at pole_radius.
  double pole_radius =
      0.0;  ///< Bank's poles, 0 < radius < 1; 0: 1 - 1.5 (least distance of lines)/(sample rate).
  std::size_t window_samples = 0;  ///< Window of the sliding DFT, 3 ... 16384; 0: period_samples.
  std::size_t period_samples = 0;  ///< Period of the excitation; 0: unknown.
  std::size_t first_sample = 0;    ///< Samples left out at the start, while transients last.
};

/// Lines at known, constant frequencies from line trackers run over the record.
///
/// Kalman bank: the mean of the settled amplitudes; with a known period over as many whole periods as there
/// are, so that lines of the same grid which the bank does not hold average out. Covariance from the scatter
/// of the periods' means (two or more), else from the noise beside each line in what the bank leaves of the
/// signals, 4/n of its density. Lines that settle too late for that (bank: settling_samples(), then a period)
/// are in `unsettled_hz`. Sliding DFT: mean and scatter of the windows that follow one another backwards from
/// the end. Least squares: covariance from the noise beside each line, and the fit's own noise gain. Limits:
/// frequencies must be right to a small part of 1/(record length); the sliding DFT needs lines on its grid
/// and two windows.
[[nodiscard]] expected<LineEstimates, Error> tracked_line_estimates(const data::Record& record,
                                                                    const TrackedLinesConfig& config,
                                                                    Approach approach);

/// plant_response of tracked_line_estimates.
[[nodiscard]] expected<data::FrequencyResponse, Error> tracked_lines(const data::Record& record,
                                                                     const TrackedLinesConfig& config,
                                                                     const ResponseOptions& options);

}  // namespace resonid::response
