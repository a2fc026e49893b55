// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "monitor/service/configuration.hpp"

namespace resonid::monitor {

/// One axis of axis_specs(): `interval_s` between false alarms of each of its detectors. What is assumed of
/// units is added to `notes`. Errors name the key, "controller"; one of units and all of files at once.
[[nodiscard]] expected<monitoring::AxisSpec, std::vector<Error>> axis_spec_of(
    const Configuration& configuration, const std::string& name, const AxisConfig& axis, double interval_s,
    std::vector<std::string>& notes);

/// A signal's column with its unit, as name or key tell it; empty: nothing does.
struct ColumnUnit {
  std::string column, unit;
};
/// What contradicts `motion` in the units of input and output, and what is required; nothing: they fit.
[[nodiscard]] std::optional<std::string> motion_fault(data::Motion motion, const ColumnUnit& input,
                                                      const ColumnUnit& output);

/// Whether the key `controller` of an axis tells it; else it names a file.
[[nodiscard]] bool tells_controller(std::string_view text);

/// The unit in a column's name, as the reader of recordings finds it; empty: none.
[[nodiscard]] std::string unit_in_name(const std::string& column);

/// The library's words with the names of its options as keys: without the dot that it puts before them.
[[nodiscard]] std::string library_keys(std::string text);

}  // namespace resonid::monitor
