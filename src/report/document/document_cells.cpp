// SPDX-License-Identifier: MIT
#include "report/document/document_cells.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace resonid::report {
namespace {

std::string optional_text(const std::optional<double>& value) { return value ? number_text(*value) : ""; }

std::string reproduced_text(const Comparison& row, std::string_view plus_minus) {
  if (!row.reproduced) return "";
  if (std::abs(*row.reproduced) < row.rounding) return "< " + number_text(row.rounding);
  return row.deviation ? number_text(*row.reproduced, *row.deviation, plus_minus)
                       : number_text(*row.reproduced);
}

bool is_number(const std::string& text) {
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return end != text.c_str() && (*end == '\0' || std::string_view(end).starts_with(" +-") ||
                                 std::string_view(end).starts_with(" \u00b1"));
}

}  // namespace

bool numeric(const Table& table, std::size_t column) {
  bool any = false;
  for (const auto& row : table.rows) {
    if (column >= row.size() || row[column].empty()) continue;
    if (!is_number(row[column])) return false;
    any = true;
  }
  return any;
}

Table written(Table table, Characters characters) {
  if (characters == Characters::ascii) return table;
  for (auto& column : table.columns) column = typeset(column);
  for (auto& row : table.rows)
    for (auto& cell : row) cell = typeset(cell);
  return table;
}

std::string number_text(double value) { return fmt::format("{:.4g}", value == 0.0 ? 0.0 : value); }

std::string number_text(double value, double deviation, std::string_view plus_minus) {
  if (!(deviation > 0.0) || !std::isfinite(value) || !std::isfinite(deviation)) return number_text(value);
  // The deviation's own rounding may carry: 0.0996 is 0.10, one decimal fewer than its logarithm says.
  const double rounded = std::stod(fmt::format("{:.1e}", deviation));
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(rounded) + 1e-9));
  if (decimals > 6 || std::abs(value) >= 1e6)
    return fmt::format("{:.4g} {} {:.2g}", value, plus_minus, deviation);
  const int shown = std::max(decimals, 0);
  std::string text = fmt::format("{:.{}f}", value, shown);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return fmt::format("{} {} {:.{}f}", text, plus_minus, rounded, shown);
}

std::string with_sign(std::string text, std::string_view sign) {
  for (auto at = text.find("+-"); at != std::string::npos; at = text.find("+-", at + sign.size()))
    text.replace(at, 2, sign);
  return text;
}

std::string legend_of(const Document& document) {
  if (document.seeds == 0) return "";
  return fmt::format(
      "Figures with +- are mean and standard deviation over {} seeds of the noise, where a table does not "
      "say "
      "otherwise.",
      document.seeds);
}

std::vector<Cells> cells_of(const ComparisonTable& table, std::string_view plus_minus) {
  std::vector<Cells> out;
  for (const Comparison& row : table.rows) {
    const std::string unit = row.unit.empty() ? "" : " (" + row.unit + ")";
    out.push_back({unit_words(with_sign(row.quantity + unit, plus_minus)), optional_text(row.published),
                   reproduced_text(row, plus_minus), optional_text(row.truth),
                   with_sign(row.note, plus_minus)});
  }
  return out;
}

}  // namespace resonid::report
