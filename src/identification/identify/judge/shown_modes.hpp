// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/fit/detail/response_modes.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// Holds the model's curve against what the measured response shows by itself, and completes the result's
/// modes from the latter.
///
/// `response-shows-more`: a dip or peak of 10 dB between known flanks that the model lacks;
/// `response-shows-less`: one of the model's that known lines contradict. Both are errors, whatever the
/// structure. Modes come from the response where the model has none or does not hold, which a choice says;
/// those that it lacks are added to its own.
void hold_against_response(const data::FrequencyResponse& response,
                           const std::vector<fit::ResponseMode>& shown, Result& result);

/// Those of the response as modes of a result.
[[nodiscard]] std::vector<data::Mode> modes_of(const std::vector<fit::ResponseMode>& shown);

}  // namespace resonid::identification::detail
