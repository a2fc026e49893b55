// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Poles and zeros of a model in the s-plane with their covariance, poles first.
[[nodiscard]] std::vector<Root> roots_of(const fit::DriveModel& drive);
/// Of a sampled model by s = ln(z)/Ts; what lies on the negative real axis or at 0 has no counterpart there
/// and is left out.
[[nodiscard]] std::vector<Root> roots_of(const fit::BlackBoxModel& model);

/// Of the result's model; none without one.
[[nodiscard]] std::vector<Root> roots_of(const Result& result);

/// Oscillating poles and zeros of a black box, undamped, from `low_hz` to `high_hz`.
[[nodiscard]] std::vector<data::Mode> modes_of(const fit::BlackBoxModel& model, double low_hz,
                                               double high_hz);

}  // namespace resonid::identification::detail
