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
  double confidence = 0.95;  ///< Of the verdict on all differences together, and of the ranges shown.
};

/// One quantity of two results.
struct Difference {
  std::string name;  ///< "stiffness", "resonance", "phase_margin"
  std::string unit;
  data::Estimate first, second;
  double change = 0.0;             ///< second - first
  std::optional<double> std;       ///< Of the change; both results are taken for independent.
  std::optional<double> relative;  ///< change / first
  std::optional<double>
      probability;           ///< Of a change at least so large by noise alone (p value); with std only.
  bool significant = false;  ///< Holds for all differences together (Holm 1979).
  /// Of the change at the confidence, from repetitions of both experiments; with bootstraps on both sides.
  std::optional<std::pair<double, double>> interval;
};

/// The models' v-gap in repetitions of both experiments (parametric bootstrap).
struct GapBootstrap {
  std::size_t pairs = 0;         ///< Of repetitions, one of either experiment.
  double low = 0.0, high = 0.0;  ///< Of their gap, at the confidence.
  double noise = 0.0;  ///< Of two repetitions on one machine, the first: not exceeded at the confidence.
  double probability =
      1.0;  ///< Of a gap at least as large as that of the models, on one machine; >= 1/(pairs + 1).
};

/// What changed between two results.
struct Changes {
  RecordFacts first, second;
  Units units;  ///< Of the first.
  double confidence = 0.95;
  std::vector<Difference> resonances;  ///< In pairs, ascending.
  std::vector<Difference> parameters;
  std::vector<Difference> margins;
  data::FrequencyResponse first_response, second_response;
  diagnostics::GapCurve gap;              ///< Of the measured responses, at lines.
  std::optional<double> gap_probability;  ///< Of the largest distance by noise alone, all lines counted.
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
/// v-gap (METHOD 10.1). Where both results have been bootstrapped, their replicas in pairs give intervals of
/// the changes and of the v-gap, and what v-gap noise alone makes, without linearisation. What cannot be
/// compared (units, structures, bands) is a finding. Limits: error bars hold noise, not what the model leaves
/// out; two records at different operating points differ by friction too. Refused: a confidence outside (0,
/// 1).
[[nodiscard]] expected<Changes, Error> compare(const Result& first, const Result& second,
                                               const CompareOptions& options = {});

}  // namespace resonid::identification
