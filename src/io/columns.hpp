// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/io/record_reader.hpp>
#include <string>
#include <vector>

#include "io/signal_names.hpp"
#include "io/units.hpp"

namespace resonid::io {

/// Indices of the table's columns that hold the signals.
struct FoundColumns {
  std::optional<std::size_t> time;
  std::vector<std::size_t> times;  ///< Those of the signals, where each has one of its own.
  std::size_t input = 0;
  std::size_t output = 0;
  std::optional<std::size_t> excitation;
  std::optional<std::size_t> reference;
  std::optional<std::size_t> position;
  std::optional<std::size_t> second_output;
};

/// A column's name without its unit, and the unit: that of a row of units, else that in the name.
[[nodiscard]] NamedUnit named_unit(const Table& table, std::size_t column);
[[nodiscard]] SignalSense sense_of_column(const Table& table, std::size_t column);

/// What the output is: as the mapping says, else as the column's name and unit tell, else a velocity.
[[nodiscard]] data::OutputQuantity output_quantity(const Table& table, const ColumnMapping& mapping,
                                                   std::size_t output);

/// Named columns must be there, the others are looked for under their usual names: first those of the symbols
/// (u, y, ru, r) and of `input...`, `output...`, `torque...`; where there are none, by what name and unit
/// say.
[[nodiscard]] expected<FoundColumns, Error> find_columns(const Table& table, const ColumnMapping& mapping);

}  // namespace resonid::io
