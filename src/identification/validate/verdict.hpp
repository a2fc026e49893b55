// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/validate.hpp>

namespace resonid::identification::detail {

/// Findings, verdict and trust of a validation whose figures are there.
void judge(ModelValidation& validation);

/// Turns errors that concern the measured response alone into warnings; true where there are any: then no
/// model is to be held against it.
[[nodiscard]] bool speaks_of_response_alone(std::vector<diagnostics::Finding>& findings);

}  // namespace resonid::identification::detail
