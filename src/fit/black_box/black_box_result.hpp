// SPDX-License-Identifier: MIT
#pragma once

#include <fit/black_box/black_box_problem.hpp>
#include <resonid/fit/black_box.hpp>

namespace resonid::fit::detail {

/// The model of a state; `covariance` is that of [alpha, c, h].
[[nodiscard]] BlackBoxModel model_of(const BlackBoxState& state, const BlackBoxLayout& layout,
                                     const BlackBoxConfig& config, const Eigen::MatrixXd& covariance);

/// No pole outside the unit circle but for one that differs from z = 1 by three standard deviations at most.
[[nodiscard]] bool is_stable(const BlackBoxModel& model);

/// 100 (1 - |y - yh|/|y - mean y|) over the samples that are not marked; the residual ends with the output.
[[nodiscard]] double fit_percent(const std::vector<double>& output, const std::vector<double>& residual,
                                 const std::vector<bool>& marked);

}  // namespace resonid::fit::detail
