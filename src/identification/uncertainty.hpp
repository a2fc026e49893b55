// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Undamped resonances and anti-resonances of a model with what its covariance makes of them, ascending.
[[nodiscard]] std::vector<Resonance> resonances_of(const fit::DriveModel& drive);

/// Poles and zeros of a model in the s-plane with their covariance, poles first.
[[nodiscard]] std::vector<Root> roots_of(const fit::DriveModel& drive);
/// Of a sampled model by s = ln(z)/Ts; what lies on the negative real axis or at 0 has no counterpart there
/// and is left out.
[[nodiscard]] std::vector<Root> roots_of(const fit::BlackBoxModel& model);

}  // namespace resonid::identification::detail
