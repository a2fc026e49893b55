// SPDX-License-Identifier: MIT
#include "report/document/batch_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/detail/figures.hpp>
#include <resonid/identification/result.hpp>
#include <resonid/report/json.hpp>

#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using identification::Batch;
using identification::Spread;

/// Figures that a table of machines leaves out: they are in the table over the recordings.
bool secondary(const std::string& name) {
  return name.find("damping_ratio") != std::string::npos || name == "offset" || name == "gain_margin_db";
}

std::string probability_text(const std::optional<double>& p) {
  if (!p) return "-";
  return *p < 1e-4 ? "< 0.0001" : fmt::format("{:.2g}", *p);
}

std::string optional_text(const std::optional<double>& value, const char* format) {
  return value && std::isfinite(*value) ? fmt::format(fmt::runtime(format), *value) : "-";
}

}  // namespace

std::string error_line(const identification::BatchEntry& entry) {
  const std::string text = error_text(entry.error);
  return text.rfind(entry.file, 0) == 0 ? text : entry.file + ": " + text;
}

std::string error_text(const Error& error) { return message_of(error); }

std::string value_text(double value, const std::optional<double>& std, double z) {
  return with_error(value, std ? z * *std : 0.0);
}

std::string heading(const Spread& figure) {
  return quantity_words(figure.name, figure.unit) +
         (figure.unit.empty() ? "" : ", " + unit_words(figure.unit));
}

Table records_table(const BatchResult& result) {
  const Batch& batch = result.batch;
  const double z = two_sided_quantile(batch.confidence);
  Table table{"", {"Recording"}, {}};
  std::vector<const Spread*> shown;
  for (const auto& f : batch.figures)
    if (!secondary(f.name)) shown.push_back(&f);
  for (const auto* f : shown) table.columns.push_back(heading(*f));
  const bool elsewhere = std::any_of(batch.entries.begin(), batch.entries.end(),
                                     [](const auto& e) { return e.result && e.result->independent; });
  table.columns.emplace_back("fit, %");
  if (elsewhere) table.columns.emplace_back("fit elsewhere, %");
  table.columns.emplace_back("verdict");
  for (std::size_t i = 0; i < batch.entries.size(); ++i) {
    const auto& entry = batch.entries[i];
    std::vector<std::string> row = {entry.file};
    for (const auto* f : shown) {
      const auto value = std::find_if(f->values.begin(), f->values.end(),
                                      [&](const Spread::Value& v) { return v.record == i; });
      row.push_back(value == f->values.end() ? "" : value_text(value->value, value->std, z));
    }
    if (entry.result) {
      const auto& r = *entry.result;
      row.push_back(r.validation ? fmt::format("{:.1f}", r.validation->fit_percent) : "");
      if (elsewhere)
        row.push_back(r.independent ? fmt::format("{:.1f}", r.independent->simulation_fit_percent) : "");
      row.emplace_back(r.trusted ? "trusted" : "NOT trusted");
    } else {
      row.insert(row.end(), elsewhere ? 2 : 1, "");
      row.emplace_back("error");
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table spread_table(const BatchResult& result) {
  const double z = two_sided_quantile(result.batch.confidence);
  Table table{"", {"Figure", "Mean", "Std. deviation", "chi2/degrees", "p", "Verdict", "Recordings"}, {}};
  for (const auto& f : result.batch.figures) {
    if (f.values.size() < 2) continue;
    const std::string ratio =
        f.chi_square ? fmt::format("{:.2f}", *f.chi_square / static_cast<double>(f.degrees)) : "-";
    table.rows.push_back({heading(f), value_text(f.mean, f.std, z), fmt::format("{:.3g}", f.deviation), ratio,
                          probability_text(f.probability),
                          !f.probability ? "not judged"
                          : f.agrees     ? "agrees"
                                         : "DIFFERS",
                          fmt::format("{}", f.values.size())});
  }
  return table;
}

Table consistency_table(const identification::Joint& joint) {
  Table table{
      "", {"Recording", "chi2", "degrees", "p", "lines' chi2/degrees", "joint fit, %", "Verdict"}, {}};
  for (const auto& r : joint.records)
    table.rows.push_back({r.file, optional_text(r.chi_square, "{:.2f}"),
                          r.chi_square ? fmt::format("{}", r.degrees) : "-", probability_text(r.probability),
                          optional_text(r.response_chi_square, "{:.2f}"),
                          optional_text(r.fit_percent, "{:.1f}"),
                          !r.agrees                               ? "DISAGREES"
                          : r.chi_square                          ? "agrees"
                          : joint.result.model && !r.own_estimate ? "no own estimate"
                                                                  : "not judged"});
  return table;
}

Table figures_table(const identification::Result& result) {
  const double z = two_sided_quantile(result.confidence);
  Table table{"", {"Figure", "Value", "Unit"}, {}};
  if (result.bootstrap) table.columns.emplace_back("Bootstrap interval");
  for (const auto& f : identification::figures(result)) {
    std::vector<std::string> row = {quantity_words(f.name, f.unit), value_text(f.value, f.std, z),
                                    unit_words(f.unit)};
    if (result.bootstrap) {
      std::string interval = "-";
      for (const auto& i : result.bootstrap->intervals)
        if (i.name == f.name) interval = interval_text(i.low, i.high);
      row.push_back(interval);
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table structures_table(const std::vector<identification::StructureTrial>& structures) {
  Table table{"Structures side by side",
              {"Structure", "Parameters", "BIC", "Fit on hold-out data, %", "Fit elsewhere, %", "Note"},
              {}};
  for (const auto& t : structures)
    table.rows.push_back({t.name + (t.chosen ? " (chosen)" : ""), fmt::format("{}", t.parameters),
                          std::isfinite(t.bic) ? fmt::format("{:.1f}", t.bic) : "-",
                          optional_text(t.holdout_fit_percent, "{:.2f}"),
                          optional_text(t.independent_fit_percent, "{:.2f}"), t.remark});
  return table;
}

Table choices_table(const std::vector<identification::Choice>& choices) {
  Table table{"Chosen from the recording", {"What", "Chosen", "Because"}, {}};
  for (const auto& c : choices) table.rows.push_back({c.what, c.chosen, c.because});
  return table;
}

std::vector<std::string> sentences(const BatchResult& result) {
  const Batch& batch = result.batch;
  std::size_t identified = 0, trusted = 0;
  for (const auto& e : batch.entries) {
    if (!e.result) continue;
    ++identified;
    if (e.result->trusted) ++trusted;
  }
  std::vector<std::string> list = {fmt::format(
      "{} recordings: {} identified, {} of them trusted{}.", batch.entries.size(), identified, trusted,
      identified < batch.entries.size()
          ? fmt::format(", {} could not be read or identified", batch.entries.size() - identified)
          : "")};
  std::string differing;
  std::size_t judged = 0;
  for (const auto& f : batch.figures) {
    if (f.probability) ++judged;
    if (!f.agrees) differing += (differing.empty() ? "" : ", ") + quantity_words(f.name);
  }
  if (!differing.empty())
    list.push_back("The recordings differ beyond their error bars in: " + differing + ".");
  else if (judged > 0)
    list.push_back(
        fmt::format("Noise explains every difference between the recordings ({} figures, {:.0f} % "
                    "confidence over all).",
                    judged, 100.0 * batch.confidence));
  if (!result.join_error.empty()) list.push_back("Not joined: " + result.join_error + ".");
  if (result.joint) {
    list.emplace_back("Joined as repetitions of one experiment:");
    for (auto& s : sentences(result.joint->result)) list.push_back(std::move(s));
  }
  return list;
}

}  // namespace resonid::report
