// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <span>

namespace resonid::identification {

/// Refuses results that no controller may be designed from, with the reason and its cure: those that are not
/// trusted, whose covariance is none, or whose machine answers before it is asked; and positions that do not
/// ascend.
[[nodiscard]] expected<void, Error> check_usable(std::span<const Result> results, const TuneOptions& options);

}  // namespace resonid::identification
