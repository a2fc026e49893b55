// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Undamped resonances and anti-resonances of a model with what its covariance makes of them, ascending.
[[nodiscard]] std::vector<Resonance> resonances_of(const fit::DriveModel& drive);

/// Poles and zeros of a model in the s-plane with their covariance, poles first.
[[nodiscard]] std::vector<Root> roots_of(const fit::DriveModel& drive);

}  // namespace resonid::identification::detail
