// SPDX-License-Identifier: MIT
#include "track_rows.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <resonid/base/error_text.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/io/detail/table.hpp>

#include "errors.hpp"

namespace resonid::cli {
namespace {

const std::vector<double>* column_of(const io::Table& table, std::string_view name) {
  const auto found = std::find(table.names.begin(), table.names.end(), name);
  return found == table.names.end() ? nullptr
                                    : &table.columns[static_cast<std::size_t>(found - table.names.begin())];
}

}  // namespace

identification::Track read_track_rows(const std::string& path, const std::string& option) {
  const auto refused = [&](const std::string& what) {
    return InputError(fmt::format("{}: '{}': {}", option, path, what));
  };
  const auto table = io::read_table(path);
  if (!table) throw InputError(option + ": " + message_of(table.error()));
  const auto *trusted = column_of(*table, "trusted"), *time = column_of(*table, "time_s"),
             *position = column_of(*table, "position_m");
  if (trusted == nullptr || time == nullptr)
    throw refused(
        fmt::format("found the columns {}; required: rows of 'resonid track --out FILE', which have "
                    "time_s and trusted",
                    fmt::join(table->names, ", ")));
  if (position == nullptr)
    throw refused("has no column position_m; required: rows of a recording with a position");
  identification::Track track;
  track.time_s = *time;
  track.position_m = *position;
  for (const double row : *trusted) track.trusted_rows.push_back(row == 1.0);
  for (const auto parameter : fit::kParameterNames) {
    const auto *value = column_of(*table, parameter),
               *std = column_of(*table, std::string(parameter) + "_std");
    if (value != nullptr && std != nullptr)
      track.parameters.push_back({std::string(parameter), "", *value, *std});
  }
  if (track.parameters.empty())
    throw refused(
        "holds no inertias, stiffness and damping; required: rows of 'resonid track --method physical'");
  return track;
}

}  // namespace resonid::cli
