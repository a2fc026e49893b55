// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/fit/response_fit.hpp>
#include <vector>

namespace resonid::fit::detail {

/// Starts for a fit to a response, that of initial_model() first; three masses have more: from a rational
/// model of fifth order, where its modes lie as those of three masses do, and with weak second pairs.
[[nodiscard]] std::vector<DriveModel> initial_models(const data::FrequencyResponse& response,
                                                     Structure structure, double sample_time_s,
                                                     bool with_friction);

}  // namespace resonid::fit::detail
