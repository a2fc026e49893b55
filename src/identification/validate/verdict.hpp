// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/validate.hpp>

namespace resonid::identification::detail {

/// Findings, verdict and trust of a validation whose figures are there.
void judge(ModelValidation& validation);

}  // namespace resonid::identification::detail
