// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/fit/output_error.hpp>
#include <vector>

namespace resonid::fit::detail {

/// What one record says of the common parameters at their common estimate, its own ones eliminated.
struct RecordScore {
  Eigen::MatrixXd fisher_information;
  Eigen::VectorXd gradient;
};

/// Each record against all others, to first order about the common estimate: with S the Fisher information of
/// all,
///
///   chi2_i = g_i' (I_i - I_i S^-1 I_i)^-1 g_i
///
/// over the directions in which both the record and the others hold at least a thousandth of the information
/// (Rao 1948, score test). Empty where all together do not determine the parameters.
[[nodiscard]] std::vector<Consistency> against_others(const std::vector<RecordScore>& records);

}  // namespace resonid::fit::detail
