// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/report/detail/document.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::report {

inline constexpr std::string_view kPlusMinus = "\xC2\xB1";

/// A line of a table as text: what every form of a document shows.
struct Cells {
  std::string quantity;    ///< with its unit in brackets
  std::string published;   ///< empty where there is none, as the next two
  std::string reproduced;  ///< with its deviation, both ended at the deviation's second digit
  std::string truth;
  std::string note;
};

/// `plus_minus` is the sign between a value and its deviation.
[[nodiscard]] std::vector<Cells> cells_of(const ComparisonTable& table, std::string_view plus_minus);

/// What a document's figures with a deviation are; empty without seeds.
[[nodiscard]] std::string legend_of(const Document& document);

/// Whether all cells of a column that are not empty are numbers, with or without their deviation.
[[nodiscard]] bool numeric(const Table& table, std::size_t column);

/// Four significant digits, no zeros at the end.
[[nodiscard]] std::string number_text(double value);
[[nodiscard]] std::string number_text(double value, double deviation, std::string_view plus_minus);

/// A table whose cells, and so whose columns, are as wide as they are written.
[[nodiscard]] Table written(Table table, Characters characters);

/// A text with `sign` for every "+-".
[[nodiscard]] std::string with_sign(std::string text, std::string_view sign);

}  // namespace resonid::report
