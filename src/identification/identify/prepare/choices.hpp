// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/excitation_source.hpp>
#include <identification/identify/prepare/plan.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// What the plan takes the excitation for, how it measures and by which approach, each with its reason.
[[nodiscard]] std::vector<Choice> explain(const data::Record& record, const Options& options,
                                          const Plan& plan, ExcitationSource source);

}  // namespace resonid::identification::detail
