// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/io/record_reader.hpp>

namespace resonid::io {

/// Indices of the table's columns that hold the signals.
struct FoundColumns {
  std::optional<std::size_t> time;
  std::size_t input = 0;
  std::size_t output = 0;
  std::optional<std::size_t> excitation;
  std::optional<std::size_t> reference;
  std::optional<std::size_t> position;
  std::optional<std::size_t> second_output;
};

/// Named columns must be there, the others are looked for under their usual names.
[[nodiscard]] expected<FoundColumns, Error> find_columns(const Table& table, const ColumnMapping& mapping);

}  // namespace resonid::io
