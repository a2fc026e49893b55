// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/io/detail/table.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// What a column of a table looks like, for a person who chooses.
struct ColumnFacts {
  std::string name;
  std::string unit;   ///< That of the row of units or in the name; empty: none.
  std::string guess;  ///< "time", "torque", "current", "velocity", "position", "acceleration"; empty: none.
  std::size_t missing = 0;
  double least = 0.0, greatest = 0.0;
};

[[nodiscard]] std::vector<ColumnFacts> column_facts(const Table& table);

}  // namespace resonid::io
