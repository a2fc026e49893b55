// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/identification/validate.hpp>
#include <vector>

namespace resonid::identification::detail {

/// The model moved by `step` along each independent standard deviation that its covariance holds.
[[nodiscard]] std::vector<CandidateModel> moved_by_deviations(const CandidateModel& candidate, double step);

/// Distance to the record's own response, by the response from input to residual. `options`: of the
/// validation; `own`: with which the record's response was measured, to `measured`.
void compare_with_response(const data::Record& record, const Options& options, const Options& own,
                           const Result& measured, ModelValidation& v);

/// Spectra, dependence, static maps, fit in the band, fit to be expected. `uncertainty`: see
/// diagnostics::residual_dependence().
void look_into_residual(const data::Record& record, const ValidateOptions& options,
                        const Eigen::MatrixXd& uncertainty, ModelValidation& v);

}  // namespace resonid::identification::detail
