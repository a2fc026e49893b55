// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::io {

struct TextLine {
  std::string_view text;
  std::size_t number = 0;  ///< From 1.
  std::size_t offset = 0;  ///< Byte at which it begins.
  bool comment = false;
};

struct RowWidth {
  std::size_t fields = 0;
  bool ends_empty = false;  ///< All rows end with an empty field, which need not be a column.
};

/// Names and units of the columns, as they stand above the rows.
struct Header {
  std::size_t line = 0;            ///< Of the names, from 1; 0 when there is none.
  std::vector<std::string> names;  ///< [column]; one more, empty, where the line ends with a separator.
  std::vector<std::string> units;  ///< [column], empty where there is none.
  double sample_interval_s = 0.0;  ///< 0: not told.
};

/// Finds the names of the columns in the lines above the first row:
///
/// - the nearest line of as many fields; where that one holds units only, it is the units' and the one above
///   it the names';
/// - a block of properties per channel (`Name`, `SymbolName`, `SampleTime[ms]` ... in the first field), as
/// the
///   scopes of several controllers write: names and units from its lines `Name` and `Unit`, in pairs of a
///   time and a value where each channel has a time of its own;
/// - a comment of as many fields (`#time,accel_x`).
///
/// @param named the line of the names, where the user tells it
/// Errors: the line next above the rows has another number of fields, a quote that is not closed.
[[nodiscard]] expected<Header, Error> find_header(const std::string& file, std::span<const TextLine> above,
                                                  const RowWidth& width, char separator,
                                                  std::optional<std::size_t> named);

/// "Sampling period is 2000000 ns": the interval that such a line tells, in s; 0 where there is none.
[[nodiscard]] double told_interval(std::span<const TextLine> above);

}  // namespace resonid::io
