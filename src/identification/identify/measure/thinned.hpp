// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>

namespace resonid::identification::detail {

/// At most 2000 of the usable lines, evenly taken: the fits' cost must not grow with the 65 535 lines of a
/// long PRBS, most of them noise. What is left out comes back in the fit to the record.
[[nodiscard]] data::FrequencyResponse thinned(const data::FrequencyResponse& response);

}  // namespace resonid::identification::detail
