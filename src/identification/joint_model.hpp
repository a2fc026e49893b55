// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/join.hpp>
#include <span>

namespace resonid::identification::detail {

/// One model of several records, and how each of them stands to the others.
struct JointModel {
  ModelResult model;
  double fit_percent = 0.0;  ///< Of all records simulated together; 0 for a model of responses.
};

/// Combines the models of the records; fills chi-square, probability and fit of `told`. Nothing when fewer
/// than two records have one.
[[nodiscard]] std::optional<JointModel> joint_model(std::span<const data::Record> records,
                                                    std::span<const Result> results, const Options& options,
                                                    std::vector<JoinedRecord>& told);

}  // namespace resonid::identification::detail
