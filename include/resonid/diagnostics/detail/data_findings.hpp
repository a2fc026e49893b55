// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/diagnostics/finding.hpp>
#include <vector>

namespace resonid::diagnostics {

/// What the record itself tells: jitter and gaps of its time stamps, a saturated or constant input.
[[nodiscard]] std::vector<Finding> inspect(const data::Record& record);

/// What a measured response tells: bands of low coherence, no usable line at all, lines that had not settled.
/// Coherence below 0.8 over at least 2 neighbouring lines (or 3 % of all) makes a band.
[[nodiscard]] std::vector<Finding> inspect(const data::FrequencyResponse& response);

}  // namespace resonid::diagnostics
