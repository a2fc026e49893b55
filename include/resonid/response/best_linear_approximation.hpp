// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/line_estimates.hpp>
#include <span>
#include <vector>

namespace resonid::response {

struct BestLinearConfig {
  std::size_t period_samples = 0;  ///< Period of every realisation, >= 4; 0: that of the first record.
  std::size_t drop_periods = 0;    ///< Periods left out at the start of each record, while transients last.
  double band_low_hz = 0.0;        ///< Lowest line, >= 0.
  double band_high_hz = 0.0;       ///< Highest line; 0: half the sample rate.
};

template <class Visitor>
void describe(Visitor&& v, BestLinearConfig& c) {
  v("period_samples", c.period_samples,
    "period of every realisation in samples; 0: that of the first record");
  v("drop_periods", c.drop_periods, "periods left out at the start of each record");
  v("band_low_hz", c.band_low_hz, "lowest line in Hz");
  v("band_high_hz", c.band_high_hz, "highest line in Hz; 0: half the sample rate");
}

/// What several realisations of a random-phase excitation tell, line by line.
struct BestLinearApproximation {
  LineEstimates lines;                 ///< The mean; its covariance from the scatter of the realisations.
  std::vector<double> noise_std;       ///< [line] of the mean response by noise alone, recorded quantity
  std::vector<double> distortion_std;  ///< [line] of the response of one realisation by non-linear distortion
  std::size_t realisations = 0;
};

/// Best linear approximation by the robust method (METHOD 8.5; Pintelon and Schoukens 2012, System
/// Identification, 4.3.1): M records, each with several periods of one random-phase realisation of the same
/// amplitude spectrum. Per record m the mean over its periods gives G_m and, by their scatter, its noise
/// variance s_m^2; over the records
///
///   G = mean G_m,   var G = sum |G_m - G|^2/(M (M - 1)),   noise: sum s_m^2/M^2,
///   distortion of one realisation: M (var G - noise), 0 where that is negative
///
/// Non-linear distortion repeats with the period, so periods do not show it; new phases do. Direct: G_m =
/// Y/U. Else U and Y are referred to Ru before they are averaged. Needs two records with two whole periods
/// each. Limits: with M records a level is known to about 1/sqrt(2 (M - 1)).
[[nodiscard]] expected<BestLinearApproximation, ConfigError> best_linear_approximation(
    std::span<const data::Record> records, const BestLinearConfig& config, Approach approach);

/// Parts of one record whose excitation has the same period but different phases, each with the first of its
/// periods (its transient) taken off: a new part begins where a period differs from the one before by more
/// than a tenth (rms). A record of one realisation gives one part.
[[nodiscard]] std::vector<data::Record> realisations_of(const data::Record& record,
                                                        std::size_t period_samples);

}  // namespace resonid::response
