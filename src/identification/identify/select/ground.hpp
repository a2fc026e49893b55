// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <resonid/fit/drive_model.hpp>

// What a response shows of a spring that ties the driven side to the ground.
namespace resonid::identification::detail {

/// Its stiffness by the lowest lines, where the velocity leads: |G| = w/K. 0: it does not.
[[nodiscard]] double ground_stiffness_of(const data::FrequencyResponse& response);

/// Whether the velocity leads at the lowest known lines, as that of a drive on a spring to the ground does.
[[nodiscard]] bool leads_at_first(const data::FrequencyResponse& response);

/// The two masses that move the driven side alike with the spring to the ground on the other side: undamped
/// exactly, for any such machine; damped as the anti-resonance is.
[[nodiscard]] fit::DriveModel with_spring_on_other_side(fit::DriveModel model);

/// The response without such a spring: impedances add up.
[[nodiscard]] data::FrequencyResponse released(data::FrequencyResponse response, double stiffness);

}  // namespace resonid::identification::detail
