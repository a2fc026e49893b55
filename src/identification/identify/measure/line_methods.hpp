// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/plan.hpp>
#include <resonid/response/best_linear_approximation.hpp>
#include <resonid/response/detail/tracked_lines.hpp>
#include <resonid/response/line_estimates.hpp>

namespace resonid::identification::detail {

using Lines = expected<response::LineEstimates, Error>;

/// What each method makes of a record: the stage `response` with the settings that plan and options mean.
[[nodiscard]] expected<response::BestLinearApproximation, Error> best_linear_lines(const data::Record& record,
                                                                                   const Plan& plan,
                                                                                   const Options& options);
[[nodiscard]] Lines periodic_lines(const data::Record& record, const Plan& plan, const Options& options);
/// At the plan's resolution, else at that of resolved_welch_lines().
[[nodiscard]] Lines welch_lines(const data::Record& record, const Plan& plan, const Options& options);
[[nodiscard]] Lines local_polynomial_lines(const data::Record& record, const Plan& plan);
[[nodiscard]] Lines local_rational_lines(const data::Record& record, const Plan& plan);
/// Along the chirp: by a tracker, or by local cubics.
[[nodiscard]] Lines swept_lines(const data::Record& record, const Plan& plan, const Options& options,
                                bool by_tracker);
/// All lines at once over the whole record.
[[nodiscard]] Lines tracked_lines(const data::Record& record, const Plan& plan, const Options& options,
                                  response::LineMethod method);
/// One sine after another.
[[nodiscard]] Lines stepped_sine_lines(const data::Record& record, const Plan& plan, const Options& options);

}  // namespace resonid::identification::detail
