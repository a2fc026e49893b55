// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/io/record_reader.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// The instants of all rows.
struct TimeAxis {
  std::vector<double> time_s;   ///< [row], NaN where the cell is missing.
  double sample_rate_hz = 0.0;  ///< As told, or of rows that are counted; 0: to be measured.
  bool measured = false;        ///< From a column of time; otherwise rows are counted.
  std::vector<std::string> notes;
};

/// Instants from the time column, in its unit: that of .time_unit, of its name or row of units; FILETIME and
/// counts since 1970 by their size; else seconds. Sample numbers and tables without a time column need a
/// rate: .sample_rate_hz, an interval above the rows, a single number `Ts` or `fs` of a MAT file.
///
/// Errors: no rate, a unit that is none of time, stamps that as seconds give less than 5 Hz and were not said
/// to be seconds: milliseconds, microseconds or sample numbers.
[[nodiscard]] expected<TimeAxis, Error> time_axis(const Table& table, const ColumnMapping& mapping,
                                                  const std::optional<std::size_t>& column, std::size_t rows);

}  // namespace resonid::io
