// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <functional>
#include <resonid/identification/validate.hpp>
#include <vector>

namespace resonid::identification::detail {

/// Lines known well enough to say where a machine was excited; nothing of a response without error bars or
/// with fewer than two such lines.
[[nodiscard]] std::optional<std::pair<double, double>> known_band(const data::FrequencyResponse& response);

/// The model moved by `step` along each independent standard deviation that its covariance holds.
[[nodiscard]] std::vector<CandidateModel> moved_by_deviations(const CandidateModel& candidate, double step);

/// Distance to the record's own response, by the response from input to residual. `options`: of the
/// validation; `own`: with which the record's response was measured, to `measured`. A line differs only where
/// the residual itself depends on that narrow band of what drives the machine: the error bars of lines are
/// estimates of few samples each. `uncertainty` is asked for only then, when the memory of measuring is free.
void compare_with_response(const data::Record& record, const Options& options, const Options& own,
                           const Result& measured,
                           const std::function<const diagnostics::ModelUncertainty&()>& uncertainty,
                           ModelValidation& v);

/// Spectra, and the fit in the bands.
void put_spectra(const data::Record& record, const ValidateOptions& options, ModelValidation& v);

/// Dependence, static maps, fit to be expected.
void look_into_residual(const data::Record& record, const diagnostics::ModelUncertainty& uncertainty,
                        ModelValidation& v);

}  // namespace resonid::identification::detail
