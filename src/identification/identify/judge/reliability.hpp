// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// What holds of a result whose findings are complete: response first, then resonances, parameters, margins.
[[nodiscard]] Reliability reliability_of(const Result& result);

}  // namespace resonid::identification::detail
