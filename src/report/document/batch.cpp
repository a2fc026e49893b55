// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/json.hpp>

#include "report/document/batch_tables.hpp"
#include "report/document/document_cells.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using identification::Batch;

/// The last characters of UTF-8 text.
std::string end_of(const std::string& text, std::size_t characters) {
  std::size_t from = text.size();
  while (from > 0 && columns_of(std::string_view(text).substr(from)) < characters) --from;
  while (from > 0 && (static_cast<unsigned char>(text[from]) & 0xC0U) == 0x80U) --from;
  return text.substr(from);
}

/// A table in as many blocks as its columns need, each beginning with the first column.
std::string blocks(const Table& table) {
  constexpr std::size_t kWidth = 100;
  constexpr std::size_t kWidestName = 40;
  const auto cell = [](const std::string& text, std::size_t width, bool left) {
    // The end of a path tells files apart.
    const std::string shown = columns_of(text) > width && left ? "..." + end_of(text, width - 3) : text;
    return left ? fmt::format("{:<{}}", shown, width) : fmt::format("{:>{}}", shown, width);
  };
  std::vector<std::size_t> width;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    std::size_t widest = columns_of(table.columns[c]);
    for (const auto& row : table.rows) widest = std::max(widest, columns_of(row[c]));
    width.push_back(c == 0 ? std::min(widest, kWidestName) : widest);
  }
  std::string text;
  for (std::size_t from = 1; from < width.size();) {
    std::size_t end = from, used = 2 + width[0];
    while (end < width.size() && (end == from || used + 2 + width[end] <= kWidth)) used += 2 + width[end++];
    const auto line = [&](const std::vector<std::string>& row) {
      std::string out = "  " + cell(row[0], width[0], true);
      for (std::size_t c = from; c < end; ++c) out += "  " + cell(row[c], width[c], false);
      text += out.substr(0, out.find_last_not_of(' ') + 1) + "\n";
    };
    line(table.columns);
    for (const auto& row : table.rows) line(row);
    from = end;
    if (from < width.size()) text += "\n";
  }
  return text;
}

}  // namespace

std::string summary_text(const BatchResult& result, Characters characters) {
  const auto table = [&](Table t) { return blocks(written(std::move(t), characters)); };
  const double percent = 100.0 * result.batch.confidence;
  std::string text = fmt::format("Recordings, {:.0f} % confidence\n", percent) + table(records_table(result));
  for (const auto& e : result.batch.entries)
    if (!e.result) text += wrapped(error_line(e), "\n  ", "    ") + "\n";
  const auto spread = spread_table(result);
  if (!spread.rows.empty()) {
    text += "\nOver the recordings\n" + table(spread);
  }
  if (result.joint) {
    text += "\nJoint estimate, each recording against the others\n" + table(consistency_table(*result.joint));
    text += fmt::format("\nJoint figures, {:.0f} % confidence intervals\n", percent) +
            table(figures_table(result.joint->result));
    text += findings_text(result.joint->result.findings);
  }
  text += "\n";
  for (const auto& s : sentences(result)) text += wrapped(s, "", "  ") + "\n";
  if (result.joint)
    text += result.joint->result.trusted
                ? "\nJoint estimate: trusted.\n"
                : "\nJoint estimate: NOT trusted, the result is not reliable; see the errors above.\n";
  return characters == Characters::unicode ? typeset(text) : text;
}

}  // namespace resonid::report
