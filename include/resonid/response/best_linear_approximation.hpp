// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/detail/distortion_level.hpp>
#include <resonid/response/detail/realisations.hpp>
#include <resonid/response/line_estimates.hpp>
#include <span>
#include <vector>

namespace resonid::response {

struct BestLinearConfig {
  std::size_t period_samples = 0;  ///< Period of every realisation, >= 4; 0: that of the first record.
  std::size_t drop_periods = 0;    ///< Periods left out at the start of each record, while transients last.
  double band_low_hz = 0.0;        ///< Lowest line, >= 0.
  double band_high_hz = 0.0;       ///< Highest line; 0: half the sample rate.
  std::vector<double> lines_hz;  ///< Lines to report (nearest of the period's grid); empty: the excited ones.
};

/// What several realisations of a random-phase excitation tell, line by line.
struct BestLinearApproximation {
  LineEstimates lines;                    ///< The mean; its covariance from the scatter of the realisations.
  std::vector<Eigen::Matrix3cd> noise;    ///< [line] covariance of the mean by noise alone
  std::vector<Eigen::Matrix3cd> scatter;  ///< [line] covariance of the mean, of that line's scatter alone
  std::vector<double> noise_std;          ///< [line] of the mean response by noise alone, recorded quantity
  std::vector<double> distortion_std;  ///< [line] of the response of one realisation by non-linear distortion
  std::size_t realisations = 0;
  /// Distortion of one realisation at the output over the output, rms over the lines, and whether the
  /// realisations scatter more than their noise explains.
  DistortionLevel level;
};

/// distortion^2 of one realisation from the variances of the mean of so many: that of the scatter and that of
/// the noise; 0 where the difference is negative.
[[nodiscard]] double distortion_variance(double scatter, double noise, std::size_t realisations);

/// Best linear approximation by the robust method (Pintelon and Schoukens 2012, 4.3.1): M records, each with
/// several periods of one random-phase realisation of the same amplitude spectrum. Per record m the mean over
/// its periods gives G_m and, by their scatter, its noise variance s_m^2; over the records
///
///   G = mean G_m,   var G = sum |G_m - G|^2/(M (M - 1)),   noise: sum s_m^2/M^2,
///   distortion of one realisation: M (var G - noise), 0 where that is negative
///
/// Non-linear distortion repeats with the period, so periods do not show it; new phases do. Direct: G_m =
/// Y/U. Else U and Y are referred to Ru before they are averaged. Few realisations tell little of one line's
/// scatter: its covariance is averaged with that of up to four neighbours on either side, as periodic_lines()
/// does. Needs two records with two whole periods each, and phases that differ (no_realisations()).
/// Limits: with M records a level is known to about 1/sqrt(2 (M - 1)).
[[nodiscard]] expected<BestLinearApproximation, Error> best_linear_approximation(
    std::span<const data::Record> records, const BestLinearConfig& config, Approach approach);

}  // namespace resonid::response
