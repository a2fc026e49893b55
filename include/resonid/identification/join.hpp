// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/identification/identify.hpp>
#include <span>
#include <string>
#include <vector>

namespace resonid::identification {

/// One record against the others.
struct JoinedRecord {
  std::string file;
  std::optional<double> chi_square;           ///< Of its parameters against the estimate from all others.
  std::size_t degrees = 0;                    ///< Of freedom: the parameters.
  std::optional<double> probability;          ///< Of a distance at least so large by the error bars alone.
  std::optional<double> response_chi_square;  ///< Of its lines against the averaged response, per degree.
  std::optional<double> fit_percent;          ///< Of the joint model, simulated on this record.
  bool agrees = true;                         ///< Judged over all records together (Bonferroni).
};

/// Repeated experiments on one machine as one estimate.
struct Joint {
  Result result;  ///< Averaged response, one model; samples of all records.
  std::vector<JoinedRecord> records;
  std::optional<double> response_chi_square;  ///< Scatter of the lines over their error bars, per degree.
  std::size_t response_degrees = 0;
};

/// Joins records of the same machine, operating point and set-up that have been identified one by one.
///
/// Response: at every line the mean of the records that have it, weighted by inverse variances; its standard
/// deviation grows by the scatter where the records scatter more than their error bars say. With
/// Method::best_linear the records are realisations of one random-phase excitation, each one or several, and
/// the response is their best linear approximation, with `distortion`. Model: the
/// structure that most records show, fitted to each record, and combined by inverse covariances in the
/// logarithms of the positive parameters,
///
///   x = (sum C_i^-1)^-1 sum C_i^-1 x_i,     chi2_i = d' (C_i + C_-i)^-1 d,  d = x_i - x_-i  (all others)
///
/// which has the joint likelihood's accuracy once every record alone determines its parameters. The finding
/// `records-disagree` (an error) names the records whose parameters noise cannot explain. Refused: fewer than
/// two records, other sample rates, quantities or units.
[[nodiscard]] expected<Joint, Refusal> join(std::span<const data::Record> records,
                                            std::span<const Result> results, const Options& options);

}  // namespace resonid::identification
