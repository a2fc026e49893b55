// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/validate.hpp>

namespace resonid::identification::detail {

/// Whether an inertia or a stiffness that the record itself tells, fitted from the candidate on, is another
/// one: by more than 2 % and by 4 standard deviations of both, those of the record widened by what its parts
/// scatter. A model of the response is not asked, nor one whose record the motion alone drives, where
/// friction would decide. Nothing where the fit does not converge.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_refit(const data::Record& record,
                                                                const CandidateModel& candidate,
                                                                const Options& options);

}  // namespace resonid::identification::detail
