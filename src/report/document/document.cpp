// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/document.hpp>

#include "report/document/chart_json.hpp"
#include "report/document/document_cells.hpp"
#include "report/document/words.hpp"
#include "report/json/put.hpp"

namespace resonid::report {
namespace {

using nlohmann::json;

constexpr std::size_t kWidth = 100;  // columns of a terminal

// --- Markdown

/// Characters that Markdown would read as marks; an underscore within a word is none.
std::string escaped(const std::string& text) {
  const auto word = [&](std::size_t i) {
    return i < text.size() && std::isalnum(static_cast<unsigned char>(text[i]));
  };
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    const bool inside_word = c == '_' && i > 0 && word(i - 1) && word(i + 1);
    if (std::string_view("\\`*_<[|").find(c) != std::string_view::npos && !inside_word) out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return typeset(out);
}

/// A paragraph must not begin like a list, a heading or a quotation.
std::string paragraph(const std::string& text) {
  const std::string out = escaped(text);
  const bool mark = !out.empty() && std::string_view("#>-+").find(out.front()) != std::string_view::npos;
  return (mark ? "\\" : "") + out + "\n\n";
}

std::string markdown_row(const std::vector<std::string>& cells) {
  std::string out = "|";
  for (const auto& cell : cells) out += " " + escaped(cell) + (cell.empty() ? "|" : " |");
  return out + "\n";
}

std::string markdown_table(const ComparisonTable& table) {
  std::string out = "### " + escaped(table.title) + "\n\n";
  out += "| quantity | published | reproduced | true | note |\n|:--|--:|--:|--:|:--|\n";
  for (const Cells& c : cells_of(table, kPlusMinus))
    out += markdown_row({c.quantity, c.published, c.reproduced, c.truth, c.note});
  return out + "\n";
}

std::string markdown_table(const Table& table) {
  std::string out = "### " + escaped(table.title) + "\n\n" + markdown_row(table.columns) + "|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) out += numeric(table, i) ? "--:|" : ":--|";
  out += "\n";
  for (const auto& row : table.rows) out += markdown_row(row);
  return out + "\n";
}

std::string markdown_discrepancies(const std::vector<Discrepancy>& list) {
  if (list.empty()) return "";
  std::string out = "## Where the paper contradicts itself, and what was taken\n\n";
  out += "| place | printed | taken | why |\n|:--|:--|:--|:--|\n";
  for (const auto& d : list) out += markdown_row({d.place, d.printed, d.taken, d.reason});
  return out + "\n";
}

// --- terminal

std::string padded(const std::string& text, std::size_t columns, bool right) {
  const std::string room(columns - std::min(columns, columns_of(text)), ' ');
  return right ? room + text : text + room;
}

/// Words in lines of at most kWidth columns; all lines but the first begin with `indent` spaces.
std::string lines_of(const std::string& text, std::size_t indent, std::size_t used = 0) {
  std::string out;
  std::size_t column = used;
  std::size_t from = 0;
  while (from < text.size()) {
    const std::size_t end = std::min(text.find_first_of(" \n", from), text.size());
    const std::string word = text.substr(from, end - from);
    from = end + 1;
    if (word.empty()) continue;
    const bool first = column == used && out.empty();
    if (!first && column + 1 + columns_of(word) > kWidth) {
      out += "\n" + std::string(indent, ' ');
      column = indent;
    } else if (!first) {
      out += ' ';
      ++column;
    }
    out += word;
    column += columns_of(word);
  }
  return out + "\n";
}

std::string text_table(const ComparisonTable& table, Characters characters) {
  const auto rows = cells_of(table, characters == Characters::unicode ? kPlusMinus : "+-");
  std::array<std::size_t, 4> widest{8, 9, 10, 4};
  for (const Cells& c : rows) {
    widest[0] = std::max(widest[0], columns_of(c.quantity));
    widest[1] = std::max(widest[1], columns_of(c.published));
    widest[2] = std::max(widest[2], columns_of(c.reproduced));
    widest[3] = std::max(widest[3], columns_of(c.truth));
  }
  const auto line = [&](const Cells& c) {
    std::string out = "  " + padded(c.quantity, widest[0], false) + "  " +
                      padded(c.published, widest[1], true) + "  " + padded(c.reproduced, widest[2], true) +
                      "  " + padded(c.truth, widest[3], true);
    const std::size_t used = columns_of(out);
    if (c.note.empty() || used + 2 + columns_of(c.note) > kWidth) out.erase(out.find_last_not_of(' ') + 1);
    if (c.note.empty()) return out + "\n";
    if (used + 2 + columns_of(c.note) <= kWidth) return out + "  " + c.note + "\n";
    return out + "\n      " + lines_of(c.note, 6, 6);
  };
  std::string out = lines_of(table.title, 2);
  out += line({"quantity", "published", "reproduced", "true", ""});
  for (const Cells& c : rows) out += line(c);
  return out + "\n";
}

/// Columns as wide as their widest cell; the last one runs on in further lines.
std::string text_table(const Table& table) {
  std::vector<std::size_t> widest(table.columns.size(), 0);
  const auto widen = [&](const std::vector<std::string>& cells) {
    for (std::size_t i = 0; i < std::min(cells.size(), widest.size()); ++i)
      widest[i] = std::max(widest[i], columns_of(cells[i]));
  };
  widen(table.columns);
  for (const auto& row : table.rows) widen(row);
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string out;
    for (std::size_t i = 0; i < std::min(cells.size(), widest.size()); ++i) {
      out += "  ";
      const std::size_t used = columns_of(out);
      if (i + 1 == widest.size() && !numeric(table, i)) return out + lines_of(cells[i], used, used);
      out += padded(cells[i], widest[i], numeric(table, i));
    }
    return out.substr(0, out.find_last_not_of(' ') + 1) + "\n";
  };
  std::string out = table.title.empty() ? "" : lines_of(table.title, 2);
  out += line(table.columns);
  for (const auto& row : table.rows) out += line(row);
  return out + "\n";
}

std::string text_discrepancies(const std::vector<Discrepancy>& list) {
  if (list.empty()) return "";
  std::string out = "WHERE THE PAPER CONTRADICTS ITSELF, AND WHAT WAS TAKEN\n\n";
  for (const auto& d : list) {
    out += lines_of(d.place, 2);
    out += "    printed  " + lines_of(d.printed, 13, 13);
    out += "    taken    " + lines_of(d.taken, 13, 13);
    out += "    why      " + lines_of(d.reason, 13, 13);
  }
  return out;
}

// --- machines

json table_json(const ComparisonTable& table) {
  json rows = json::array();
  for (const Comparison& r : table.rows) {
    json row{{"quantity", r.quantity}};
    if (!r.unit.empty()) row["unit"] = r.unit;
    put(row, "published", r.published);
    put(row, "reproduced", r.reproduced);
    put(row, "deviation", r.deviation);
    put(row, "true", r.truth);
    if (!r.note.empty()) row["note"] = r.note;
    rows.push_back(std::move(row));
  }
  return {{"title", table.title}, {"rows", std::move(rows)}};
}

json shape_json(const Shape& shape) {
  json out{{"kind", name_of(shape.kind)}, {"name", shape.name}, {"x", shape.x}, {"y", shape.y}};
  if (shape.kind == Shape::Kind::circle) out["radius"] = shape.radius;
  if (shape.kind == Shape::Kind::rectangle) {
    out["x_end"] = shape.x_end;
    out["y_end"] = shape.y_end;
  }
  return out;
}

json intervals_json(const Intervals& list) {
  json out{{"title", list.title}, {"unit", list.unit}, {"rows", json::array()}};
  for (const auto& row : list.rows)
    out["rows"].push_back({{"name", row.name}, {"value", row.value}, {"half_width", row.half_width}});
  put(out, "mean", list.mean);
  if (list.mean) out["mean_half_width"] = list.mean_half_width;
  if (!list.verdict.empty()) out["verdict"] = list.verdict;
  return out;
}

json section_json(const Section& s) {
  json section{{"title", s.title}, {"text", s.text}, {"tables", json::array()}, {"charts", json::array()}};
  for (const auto& table : s.tables) section["tables"].push_back(table_json(table));
  for (const auto& chart : s.charts) section["charts"].push_back(chart_json(chart));
  for (const auto& table : s.plain_tables)
    section["plain_tables"].push_back(
        {{"title", table.title}, {"columns", table.columns}, {"rows", table.rows}});
  for (const auto& list : s.intervals) section["intervals"].push_back(intervals_json(list));
  return section;
}

}  // namespace

json chart_json(const Chart& chart) {
  json curves = json::array();
  for (const Curve& c : chart.curves) {
    json curve{{"name", c.name}, {"mark", name_of(c.mark)}, {"x", c.x}, {"y", c.y}};
    if (!c.at.empty()) {
      curve["at"] = c.at;
      curve["at_unit"] = chart.at_unit;
    }
    if (!c.lower.empty()) {
      curve["lower"] = c.lower;
      curve["upper"] = c.upper;
    }
    curves.push_back(std::move(curve));
  }
  json out{{"title", chart.title},       {"x_label", chart.x_label},       {"y_label", chart.y_label},
           {"log_x", chart.log_x},       {"equal_axes", chart.equal_axes}, {"caption", chart.caption},
           {"curves", std::move(curves)}};
  for (const Shape& shape : chart.shapes) out["shapes"].push_back(shape_json(shape));
  if (chart.x_range) out["x_range"] = {chart.x_range->low, chart.x_range->high};
  if (chart.y_range) out["y_range"] = {chart.y_range->low, chart.y_range->high};
  if (const auto& m = chart.map)
    out["map"] = {{"x", m->x}, {"y", m->y}, {"value", m->value}, {"unit", m->unit}};
  return out;
}

std::string document_markdown(const Document& document) {
  std::string out = "# " + escaped(document.title) + "\n\n";
  if (!document.command.empty()) out += "Made by\n\n    " + document.command + "\n\n";
  if (document.seeds > 0) out += paragraph(legend_of(document));
  for (const auto& text : document.summary) out += paragraph(text);
  for (const Section& section : document.sections) {
    out += "## " + escaped(section.title) + "\n\n";
    for (const auto& text : section.text) out += paragraph(text);
    for (const auto& table : section.tables) out += markdown_table(table);
    for (const auto& table : section.plain_tables) out += markdown_table(table);
  }
  out += markdown_discrepancies(document.discrepancies);
  out.pop_back();  // ends with one line break, not two
  return out;
}

std::string document_text(const Document& document, Characters characters) {
  std::string out = lines_of(document.title, 0) + "\n";
  for (const auto& text : document.summary) out += lines_of(text, 0);
  if (document.seeds > 0) out += lines_of(legend_of(document), 0);
  if (!document.summary.empty() || document.seeds > 0) out += "\n";
  for (const Section& section : document.sections) {
    if (section.tables.empty() && section.plain_tables.empty()) continue;
    std::string title = section.title;
    std::transform(title.begin(), title.end(), title.begin(),
                   [](unsigned char c) { return static_cast<char>(c < 0x80 ? std::toupper(c) : c); });
    out += lines_of(title, 0) + "\n";
    for (const auto& table : section.tables) out += text_table(table, characters);
    for (const auto& table : section.plain_tables) out += text_table(written(table, characters));
  }
  out += text_discrepancies(document.discrepancies);
  return characters == Characters::unicode ? typeset(out) : out;
}

json document_json(const Document& document) {
  json sections = json::array();
  for (const Section& s : document.sections) sections.push_back(section_json(s));
  json discrepancies = json::array();
  for (const auto& d : document.discrepancies)
    discrepancies.push_back(
        {{"place", d.place}, {"printed", d.printed}, {"taken", d.taken}, {"reason", d.reason}});
  json whole{{"schema", "resonid.document/1"},  {"title", document.title},
             {"command", document.command},     {"summary", document.summary},
             {"sections", std::move(sections)}, {"discrepancies", std::move(discrepancies)}};
  if (document.seeds > 0) whole["seeds"] = document.seeds;
  if (const auto& b = document.badge)
    whole["badge"] = {{"good", b->good}, {"word", b->word}, {"reason", b->reason}};
  if (document.badge && document.badge->warning) whole["badge"]["warning"] = true;
  for (const Card& c : document.cards)
    whole["cards"].push_back({{"name", c.name}, {"value", c.value}, {"unit", c.unit}, {"under", c.under}});
  if (document.provenance) put_provenance(whole, *document.provenance);
  if (!document.facts.empty()) whole["facts"] = document.facts;
  if (document.findings) {
    whole["findings"] = json::array();
    for (const auto& f : *document.findings)
      whole["findings"].push_back({{"id", f.id}, {"severity", name_of(f.severity)}, {"meaning", f.meaning}});
  }
  return whole;
}

}  // namespace resonid::report
