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
  std::optional<double> chi_square;  ///< Distance of its parameters from the estimate of all others.
  std::size_t degrees = 0;           ///< Degrees of freedom: the parameters.
  /// Probability of a distance at least so large by the error bars alone.
  std::optional<double> probability;
  /// Distance of its lines from the averaged response, per degree.
  std::optional<double> response_chi_square;
  std::optional<double> fit_percent;  ///< Fit of the joint model, simulated on this record.
  bool own_estimate = false;          ///< It says something of `degrees` parameters or combinations of them.
  bool agrees = true;                 ///< Judged over all records together (Bonferroni).
};

/// Repeated experiments on one machine as one estimate.
struct Joint {
  Result result;  ///< Averaged response, one model; samples of all records.
  std::vector<JoinedRecord> records;
  std::optional<double> response_chi_square;  ///< Scatter of the lines over their error bars, per degree.
  std::size_t response_degrees = 0;
};

/// Refused: black boxes, which are not joined.
[[nodiscard]] expected<void, Error> check_join(const Options& options);

/// Joins records of the same machine, operating point and set-up that have been identified one by one with
/// these options.
///
/// Response: at every line the mean of the records that have it, weighted by inverse variances; its standard
/// deviation grows by the scatter where the records scatter more than their error bars say. With
/// Method::best_linear the records are realisations of one random-phase excitation, each one or several, and
/// the response is their best linear approximation, with `distortion`.
///
/// Model: one likelihood over all records, each with its own initial state, offset and noise; records that do
/// not determine a model by themselves count in it too. The structure is that which most records show; where
/// none shows any, or most but a rigid machine, it is chosen by all records as identify() does by one. Every
/// record is compared with the others by a score test (fit::JointOutputErrorFit::against_others). Records
/// whose models were fitted to responses, and those whose likelihood finds no optimum, are combined by
/// inverse covariances, in logarithms of the positive parameters, and compared with one another by
///
///   x = (sum C_i^-1)^-1 sum C_i^-1 x_i,     chi2_i = d' (C_i + C_-i)^-1 d,  d = x_i - x_-i  (all others)
///
/// over the parameters that both know better than to a factor of e. The finding `records-disagree` (an error)
/// names the records whose parameters noise cannot explain, `undetermined-record` those that say nothing.
/// With Options::bootstrap all experiments are repeated on the joint model, each with its own noise, and
/// fitted together again; combined estimates have no such fit (`no-joint-bootstrap`).
/// Refused: fewer than two records, other sample rates, quantities or units, black boxes, and what identify()
/// refuses to prepare.
[[nodiscard]] expected<Joint, Error> join(std::span<const data::Record> records,
                                          std::span<const Result> results, const Options& options = {});

}  // namespace resonid::identification
