// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/planning/plan.hpp>
#include <string>
#include <string_view>

// Words that summary, JSON and page of a plan share.
namespace resonid::report {

/// Deviation that the i-th accuracy target allows, in the figure's unit.
[[nodiscard]] double wanted_of(const planning::Plan& plan, std::size_t i);

/// "chirp", "PRBS".
[[nodiscard]] std::string_view type_words(planning::ExcitationType type);

/// The deviation in percent of the value, or of a margin in degrees in its unit.
[[nodiscard]] std::string relative_text(const planning::Figure& figure);

}  // namespace resonid::report
