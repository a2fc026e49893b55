// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/methods.hpp>
#include <resonid/identification/join.hpp>
#include <span>

namespace resonid::identification::detail {

/// One model of several records, and how it was come by.
struct JointModel {
  ModelResult model;
  bool one_likelihood = false;  ///< Else the records' own estimates were combined.
  double fit_percent = 0.0;     ///< Of all records simulated together; 0 for a model of responses.
  double residual_rms = 0.0;    ///< Likewise.
  std::vector<Choice> choices;
  std::vector<StructureTrial> structures;  ///< Where the structure was chosen by all records together.
  std::vector<diagnostics::Finding> findings;
};

/// The model of all records in one likelihood, or the combination of the records' own ones where they are
/// models of responses or the likelihood finds no optimum; fills chi-square, probability and fit of `told`.
/// The records are prepared and have one sample rate; `response` is the joined one, over the plan's band.
/// Nothing when there is no likelihood and fewer than two records have a model.
[[nodiscard]] std::optional<JointModel> joint_model(std::span<const data::Record> records,
                                                    std::span<const Result> results, const Plan& plan,
                                                    const Options& options,
                                                    const data::FrequencyResponse& response,
                                                    std::vector<JoinedRecord>& told);

}  // namespace resonid::identification::detail
