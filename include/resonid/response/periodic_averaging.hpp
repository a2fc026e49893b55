// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

struct PeriodicConfig {
  std::size_t period_samples = 0;  ///< Period of the excitation, >= 4; 0: detect_period().
  std::size_t drop_periods = 0;    ///< Periods left out at the start, while transients last.
  std::vector<double>
      lines_hz;  ///< Lines to report (nearest lines of the period's grid); empty: the excited ones.
  double band_low_hz = 0.0;   ///< Lowest line, >= 0.
  double band_high_hz = 0.0;  ///< Highest line; 0: half the sample rate.
};

/// Lines of a periodic experiment (multisine, repeated PRBS or chirp): one Fourier transform per period, mean
/// and scatter over the n whole periods (Pintelon and Schoukens 2012, ch. 2). Covariance of the means: sum_p
/// (X_p - X)(X_p - X)^H/(n (n - 1)), n - 1 complex degrees of freedom, averaged over up to four neighbours on
/// either side where these are fewer than twelve; no leakage, no bias under feedback. A slow drift of the
/// signals (line through the period means) is taken out. A line is excited when its reference signal passes
/// excited_power_threshold() and stands out of the scatter (F test, 0.1 %). Coherence: |sum Y_p R_p*|^2/(sum
/// |Y_p|^2 sum |R_p|^2). Limits: needs two whole periods after the dropped ones; transients that outlast them
/// show up as noise.
[[nodiscard]] expected<LineEstimates, Error> periodic_lines(const data::Record& record,
                                                            const PeriodicConfig& config, Approach approach);

/// Whole periods at the record's start in which the drive has not settled: their rms distance from the mean
/// of the record's last half (two periods at least) is more than twice the largest among the periods of that
/// half, and more than a thousandth of the motion. 0 with fewer than three. Positions count by their
/// differences, since they drift. None where the last but one (of two: the last) is still as far from it as
/// 0.7 of the first: what does not decay is a machine that changes. `period_samples` >= 4.
[[nodiscard]] std::size_t transient_periods(const data::Record& record, std::size_t period_samples);

/// plant_response of periodic_lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> periodic_average(const data::Record& record,
                                                                        const PeriodicConfig& config,
                                                                        const ResponseOptions& options);

}  // namespace resonid::response
