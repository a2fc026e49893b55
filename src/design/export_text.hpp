// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "design/export.hpp"

namespace resonid::design {

/// What every target asks of a text, whatever the law.
[[nodiscard]] expected<void> check_text(const std::string& name, double sample_time_s,
                                        const std::optional<double>& torque_limit);

/// What every target asks of a controller.
[[nodiscard]] expected<void> check_exported(const ExportedController& design);

/// What the gains change by per unit of the position, from a node to the next one; behind the last one 0.
struct ScheduleSlope {
  double kp = 0.0, ki = 0.0;
};
[[nodiscard]] ScheduleSlope slope_behind(const std::vector<ScheduleNode>& nodes, std::size_t i);

/// 17 digits, with a decimal point: read back it is the same number everywhere.
[[nodiscard]] std::string digits_17(double value);

/// A number of C in that type, and the guard of a header.
using CNumberText = std::function<std::string(double)>;
[[nodiscard]] CNumberText c_number_text(CNumber type);
[[nodiscard]] std::string c_guard_of(const std::string& name);

/// " The position may move at up to 0.3 of its units per s." where a schedule's position has a largest
/// speed.
[[nodiscard]] std::string speed_comment(const ExportedController& design);

/// "P" where there is no integral part, else "PI".
[[nodiscard]] std::string law_word(const ExportedController& design);

/// A text in which each @key@ is replaced by its value.
using TextValues = std::vector<std::pair<std::string_view, std::string>>;
[[nodiscard]] std::string filled_in(std::string_view text, const TextValues& values);

}  // namespace resonid::design
