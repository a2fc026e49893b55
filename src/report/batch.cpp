// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/batch.hpp>
#include <resonid/report/json.hpp>

#include "report/batch_tables.hpp"
#include "report/put.hpp"
#include "report/words.hpp"

namespace resonid::report {
namespace {

using identification::Batch;
using nlohmann::json;

json spread_json(const identification::Spread& f) {
  json values = json::array();
  for (const auto& v : f.values) {
    json j{{"record", v.record}, {"value", v.value}};
    put(j, "std", v.std);
    values.push_back(std::move(j));
  }
  json j{{"name", f.name}, {"unit", f.unit}, {"values", std::move(values)}, {"mean", f.mean}};
  put(j, "std", f.std);
  if (f.values.size() > 1) j["deviation"] = f.deviation;
  if (!f.probability) return j;
  put(j, "chi_square", f.chi_square);
  j["degrees_of_freedom"] = f.degrees;
  j["probability"] = *f.probability;
  j["agrees"] = f.agrees;
  return j;
}

json joint_json(const identification::Joint& joint) {
  json records = json::array();
  for (const auto& r : joint.records) {
    json j{{"file", r.file}, {"own_estimate", r.own_estimate}, {"agrees", r.agrees}};
    put(j, "chi_square", r.chi_square);
    if (r.chi_square) j["degrees_of_freedom"] = r.degrees;
    put(j, "probability", r.probability);
    put(j, "response_chi_square", r.response_chi_square);
    put(j, "fit_percent", r.fit_percent);
    records.push_back(std::move(j));
  }
  json j{{"result", to_json(joint.result)}, {"records", std::move(records)}};
  put(j, "response_chi_square", joint.response_chi_square);
  return j;
}

/// A table in as many blocks as its columns need, each beginning with the first column.
std::string blocks(const Table& table) {
  constexpr std::size_t kWidth = 100;
  constexpr std::size_t kWidestName = 40;
  const auto cell = [](const std::string& text, std::size_t width, bool left) {
    // The end of a path tells files apart.
    const std::string shown =
        text.size() > width && left ? "..." + text.substr(text.size() - width + 3) : text;
    return left ? fmt::format("{:<{}}", shown, width) : fmt::format("{:>{}}", shown, width);
  };
  std::vector<std::size_t> width;
  for (std::size_t c = 0; c < table.columns.size(); ++c) {
    std::size_t widest = table.columns[c].size();
    for (const auto& row : table.rows) widest = std::max(widest, row[c].size());
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

json to_json(const BatchResult& result) {
  const Batch& batch = result.batch;
  json j{{"schema", "resonid.identifications/1"},
         {"confidence", batch.confidence},
         {"results", json::array()},
         {"table", {{"figures", json::array()}}}};
  for (const auto& e : batch.entries) {
    json entry = e.result ? to_json(*e.result) : json{{"error", error_text(e.error)}};
    entry["file"] = e.file;
    j["results"].push_back(std::move(entry));
  }
  for (const auto& f : batch.figures) j["table"]["figures"].push_back(spread_json(f));
  if (result.joint) j["joint"] = joint_json(*result.joint);
  if (!result.join_error.empty()) j["join_error"] = result.join_error;
  return j;
}

std::string summary_text(const BatchResult& result) {
  const double percent = 100.0 * result.batch.confidence;
  std::string text = fmt::format("Records, {:.0f} % confidence\n", percent) + blocks(records_table(result));
  for (const auto& e : result.batch.entries)
    if (!e.result) text += wrapped(error_line(e), "\n  ", "    ") + "\n";
  const auto spread = spread_table(result);
  if (!spread.rows.empty()) {
    text += "\nOver the records (scatter: their standard deviation)\n" + blocks(spread);
  }
  if (result.joint) {
    text += "\nJoint estimate, each record against the others\n" + blocks(consistency_table(*result.joint));
    text += fmt::format("\nJoint figures, {:.0f} % confidence\n", percent) +
            blocks(figures_table(result.joint->result));
    text += findings_text(result.joint->result.findings);
  }
  text += "\n";
  for (const auto& s : sentences(result)) text += wrapped(s, "", "  ") + "\n";
  if (result.joint)
    text += result.joint->result.trusted ? "\nJoint estimate: trusted.\n"
                                         : "\nJoint estimate: NOT trusted, see the errors above.\n";
  return text;
}

}  // namespace resonid::report
