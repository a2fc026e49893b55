// SPDX-License-Identifier: MIT
#include "io/optional_columns.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "io/text.hpp"

namespace resonid::io {
namespace {

using Place = std::optional<std::size_t>;

struct OptionalSignal {
  Place FoundColumns::*column;
  bool named;
};

/// Whether a signal has too few values in the rows that the others have.
bool is_sparse(const std::vector<double>& x, const std::vector<std::size_t>& rows) {
  const auto there = [&](std::size_t row) { return !std::isnan(x[row]); };
  const auto first = std::find_if(rows.begin(), rows.end(), there);
  const auto last = std::find_if(rows.rbegin(), rows.rend(), there).base();
  if (first >= last) return true;
  const auto inside = static_cast<double>(last - first);
  const auto empty = inside - static_cast<double>(std::count_if(first, last, there));
  return inside < 0.5 * static_cast<double>(rows.size()) || empty > kMostMissing * inside;
}

}  // namespace

std::vector<std::size_t> signal_columns(const FoundColumns& found) {
  std::vector<std::size_t> columns;
  for (const auto& column : {Place(found.input), Place(found.output), found.excitation, found.reference,
                             found.position, found.second_output})
    if (column) columns.push_back(*column);
  return columns;
}

std::vector<std::string> leave_out_sparse(const Table& table, const ColumnMapping& mapping,
                                          std::span<const std::size_t> rows, FoundColumns& found) {
  const OptionalSignal optional[] = {{&FoundColumns::excitation, mapping.excitation.has_value()},
                                     {&FoundColumns::reference, mapping.reference.has_value()},
                                     {&FoundColumns::position, mapping.position.has_value()},
                                     {&FoundColumns::second_output, mapping.second_output.has_value()}};
  std::vector<std::size_t> needed = {found.input, found.output};
  for (const auto& signal : optional)
    if (signal.named && found.*signal.column) needed.push_back(*(found.*signal.column));
  std::vector<std::size_t> whole;
  for (const std::size_t row : rows)
    if (std::none_of(needed.begin(), needed.end(),
                     [&](std::size_t c) { return std::isnan(table.columns[c][row]); }))
      whole.push_back(row);
  std::vector<std::string> notes;
  for (const auto& signal : optional) {
    Place& column = found.*signal.column;
    if (signal.named || !column || whole.empty() || !is_sparse(table.columns[*column], whole)) continue;
    const auto& x = table.columns[*column];
    const auto empty =
        std::count_if(rows.begin(), rows.end(), [&](std::size_t row) { return std::isnan(x[row]); });
    notes.push_back(fmt::format("{} left out: {} of its {} cells are empty", in_quotes(table.names[*column]),
                                empty, rows.size()));
    if (!found.times.empty()) {
      const auto all = signal_columns(found);
      found.times.erase(found.times.begin() + (std::find(all.begin(), all.end(), *column) - all.begin()));
    }
    column.reset();
  }
  return notes;
}

}  // namespace resonid::io
