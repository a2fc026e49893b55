// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <utility>
#include <vector>

namespace resonid::identification {

struct CompareOptions {
  /// What both responses are multiplied by before their distance is taken, usually the controller: distances
  /// depend on the unit of G. Absent: as they are.
  std::optional<data::TransferFunction> weight;
  /// Confidence of the verdict on all differences together, and of the ranges shown.
  double confidence = 0.95;
};

/// One quantity of two results.
struct Difference {
  std::string name;  ///< "stiffness", "resonance", "phase_margin"
  std::string unit;
  data::Estimate first, second;
  double change = 0.0;        ///< second - first
  std::optional<double> std;  ///< Standard deviation of the change; both results are taken for independent.
  std::optional<double> relative;  ///< change / first
  /// p value: of a change at least so large by noise alone; with std only.
  std::optional<double> probability;
  bool significant = false;  ///< Holds for all differences together (Holm 1979).
  /// Interval of the change at the confidence, from repetitions of both experiments; with bootstraps on both
  /// sides.
  std::optional<std::pair<double, double>> interval;
};

/// The models' v-gap in repetitions of both experiments (parametric bootstrap).
struct GapBootstrap {
  std::size_t pairs = 0;         ///< Pairs of repetitions, one of either experiment.
  double low = 0.0, high = 0.0;  ///< Interval of their gap, at the confidence.
  /// Gap of two repetitions on the first machine that is not exceeded at the confidence.
  double noise = 0.0;
  /// Probability of a gap at least as large as the models', on one machine; >= 1/(pairs + 1).
  double probability = 1.0;
};

/// What changed between two results.
struct Changes {
  RecordFacts first, second;
  Units units;  ///< Units of the first.
  double confidence = 0.95;
  std::vector<Difference> resonances;  ///< In pairs, ascending.
  std::vector<Difference> parameters;
  std::vector<Difference> margins;
  data::FrequencyResponse first_response, second_response;
  diagnostics::GapCurve gap;  ///< Gap of the measured responses, at lines.
  /// Probability of the largest distance by noise alone, over all lines.
  std::optional<double> gap_probability;
  bool gap_significant = false;
  std::optional<diagnostics::NuGap> model_gap;  ///< With models on both sides.
  std::optional<double> model_gap_std;
  std::optional<GapBootstrap> model_gap_bootstrap;  ///< With the bootstraps of models on both sides.
  bool weighted = false;
  bool changed = false;  ///< Any difference is significant.
  bool trusted = false;  ///< Both results are, and they can be compared.
  std::vector<diagnostics::Finding> findings;

  [[nodiscard]] std::vector<Difference> all() const;
};

/// Compares resonances, parameters, margins and responses, with the significance of every difference:
///
///   z = change / sqrt(std_1^2 + std_2^2),   p = erfc(|z|/sqrt 2)
///
/// and a verdict over all of them together: Holm's procedure at 1 - confidence, so that two results of the
/// same machine differ in none of them with that probability. Quantities without a standard deviation are
/// shown and not judged. The responses' distance is pointwise (lines know no winding number); models give the
/// v-gap (Vinnicombe 1993). Where both results have been bootstrapped, their replicas in pairs give intervals
/// of the changes and of the v-gap, and what v-gap noise alone makes, without linearisation. What cannot be
/// compared (units, structures, bands) is a finding. Limits: error bars hold noise, not what the model leaves
/// out; two records at different operating points differ by friction too. Refused: a confidence outside (0,
/// 1).
[[nodiscard]] expected<Changes, Error> compare(const Result& first, const Result& second,
                                               const CompareOptions& options = {});

}  // namespace resonid::identification
