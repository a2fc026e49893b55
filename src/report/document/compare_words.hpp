// SPDX-License-Identifier: MIT
#pragma once

#include <string>

// Words that the text and the page of a comparison share.
namespace resonid::report {

/// "phase_margin" -> "phase margin"
[[nodiscard]] std::string spaced_name(std::string name);
[[nodiscard]] std::string capitalised(std::string text);
/// 0.0003 -> "0.0003"; what no record can tell from 0 -> "< 1e-12".
[[nodiscard]] std::string probability_of_change(double p);
[[nodiscard]] std::string with_unit(const std::string& number, const std::string& unit);

}  // namespace resonid::report
