// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/tune.hpp>
#include <sstream>
#include <utility>

#include "report/document/tune_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using identification::LoopFigure;
using identification::TunedController;
using identification::Tuning;

constexpr const char* kAt = "at, Hz";

std::string optional_cell(const ShownUnit& unit, const std::optional<double>& value) {
  return value && std::isfinite(*value) ? unit.number(*value) : "";
}

std::string with_unit_of(const TunedController& c, const LoopFigure& figure) {
  const auto unit = shown_unit(figure).unit;
  return loop_figure_words(figure.name, c.position_gain.has_value()) + (unit.empty() ? "" : ", " + unit);
}

/// In the unit of the first controller; empty where it has another one.
std::string figure_cell(const Tuning& t, const TunedController& c, const char* name) {
  if (unit_of_figure(c, name) != unit_of_figure(t.proposed(), name)) return {};
  const auto value = value_of(c, name);
  return value && c.stable ? three_digits(*value) : "";
}

/// A share of 100 in a column whose head has the unit.
std::string percent_cell(const std::optional<double>& share) {
  if (!share) return {};
  const auto text = share_text(*share);
  return *share > 0.0 && *share < 1e-4 ? "0.01" : text.substr(0, text.find(" %"));
}

/// A cell in lines of at most `width` columns, from the second on indented.
std::vector<std::string> broken(const std::string& cell, std::size_t width) {
  std::istringstream text(wrapped(cell, "", "  ", width));
  std::vector<std::string> lines(1);
  std::getline(text, lines.front());
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

/// What is left for the first column where lines of such columns would be too long for a terminal.
std::size_t first_width(const std::vector<std::size_t>& width) {
  constexpr std::size_t kLeast = 24;
  std::size_t all = 0;
  for (const std::size_t w : width) all += w == 0 ? 0 : 2 + w;
  const std::size_t beyond = all > kTerminalColumns ? all - kTerminalColumns : 0;
  return std::min(width.front(), std::max(kLeast + beyond, width.front()) - beyond);
}

/// Rows of texts under their columns' names, the first column to the left; columns without a cell are left
/// out.
std::string table_text(const Table& table) {
  std::vector<std::size_t> width;
  for (std::size_t k = 0; k < table.columns.size(); ++k) {
    std::size_t widest = 0;
    for (const auto& row : table.rows) widest = std::max(widest, columns_of(row[k]));
    width.push_back(widest == 0 ? 0 : std::max(widest, columns_of(table.columns[k])));
  }
  width.front() = first_width(width);
  const auto line = [&](const std::vector<std::string>& cells) {
    const auto first = broken(cells.front(), width.front());
    const std::size_t long_word = std::max(width.front(), columns_of(first.front()));
    std::string text = "  " + first.front() + std::string(long_word - columns_of(first.front()), ' ');
    for (std::size_t k = 1; k < cells.size(); ++k)
      if (width[k] > 0) text += "  " + std::string(width[k] - columns_of(cells[k]), ' ') + cells[k];
    text = text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
    for (std::size_t i = 1; i < first.size(); ++i) text += "  " + first[i] + "\n";
    return text;
  };
  std::string text = "\n" + wrapped(table.title, "", "  ") + "\n" + line(table.columns);
  for (const auto& row : table.rows) text += line(row);
  return text;
}

/// The same without a column, which stands elsewhere.
Table without(Table table, std::string_view column) {
  const auto found = std::find(table.columns.begin(), table.columns.end(), column);
  if (found == table.columns.end()) return table;
  const auto at = found - table.columns.begin();
  table.columns.erase(found);
  for (auto& row : table.rows) row.erase(row.begin() + at);
  return table;
}

std::string machine_line(const Tuning& t) {
  std::string text = fmt::format("{} at {:g} Hz", fmt::join(t.files, ", "), 1.0 / t.sample_time_s);
  if (t.machines.empty()) return text;
  const auto& m = t.machines.front();
  text += fmt::format(
      ": {}{} drive",
      t.machines.size() > 1 ? fmt::format("{} machines, that of {}: ", t.machines.size(), first_file(t)) : "",
      fit::name_of(m.structure));
  for (const auto& mode : m.modes())
    text += fmt::format(", {} {} Hz", mode.name(), three_digits(mode.frequency_hz.value));
  return text + fmt::format(", delay {} ms", three_digits(1e3 * (m.known_delay_s + m.delay_s)));
}

}  // namespace

std::vector<ComparedController> compared_controllers(const Tuning& t) {
  std::vector<ComparedController> list;
  for (const auto& c : t.candidates) list.push_back({c, c.name});
  if (t.nominal) list.push_back({*t.nominal, t.nominal->name + ", nominal"});
  if (t.running) list.push_back({*t.running, "running"});
  return list;
}

Table candidate_table(const Tuning& t) {
  const auto units = gain_units(t.units.input, t.units.velocity);
  const auto iae_unit = unit_of_figure(t.proposed(), "load_step_iae");
  Table table{
      units.kp.empty() ? "Controllers" : fmt::format("Controllers, kp in {}, ki in {}", units.kp, units.ki),
      {"controller", "kp", "ki", "|S|",
       loop_figure_symbol("load_peak", t.proposed().position_gain.has_value()),
       iae_unit.empty() ? "IAE" : "IAE, " + iae_unit, "noise gain", "exceeds, %", "remark"},
      {}};
  if (is_for_several(t)) table.title += "; figures of " + machine_words(t);
  for (const auto& [c, name] : compared_controllers(t)) {
    const bool first = &c == &t.candidates.front();
    table.rows.push_back(
        {name, c.gains ? three_digits(c.gains->kp) : "", c.gains && !is_p(c) ? three_digits(c.gains->ki) : "",
         figure_cell(t, c, "sensitivity_peak"),
         are_alike(c, t.proposed()) ? figure_cell(t, c, "load_peak") : "", figure_cell(t, c, "load_step_iae"),
         figure_cell(t, c, "noise_gain"),
         percent_cell(c.draws > 0 && c.stable ? std::optional(c.probability()) : std::nullopt),
         !c.stable                     ? (stability_is_unknown(t) && first ? "not told stable" : "unstable")
         : !c.remark.empty()           ? c.remark
         : first && !t.is_evaluation() ? "proposed"
                                       : ""});
  }
  return table;
}

Table figure_table(const TunedController& c) {
  Table table{"", {"figure", "value", kAt, "95 % from", "95 % to", "worst", "bound", "exceeded, %"}, {}};
  for (const auto& figure : c.figures) {
    const auto unit = shown_unit(figure);
    table.rows.push_back({with_unit_of(c, figure), is_worst_alone(figure) ? "" : unit.number(figure.value),
                          figure.frequency_hz ? three_digits(*figure.frequency_hz) : "",
                          optional_cell(unit, figure.low), optional_cell(unit, figure.high),
                          optional_cell(unit, figure.worst), optional_cell(unit, figure.bound),
                          percent_cell(figure.probability)});
  }
  const bool has_frequencies = std::ranges::any_of(
      c.figures, [](const LoopFigure& figure) { return figure.frequency_hz.has_value(); });
  return has_frequencies ? table : without(std::move(table), kAt);
}

Table crossing_table(const TunedController& c) {
  const std::string low = "95 % from", high = "95 % to";
  Table table{"Crossings of |L| = 1 (margin: angle to -1, of L below or above the real axis)",
              {kAt, low, high, "|L|", "side", "margin, deg", low, high, "least", "delay margin, ms"},
              {}};
  const auto hertz = [](const std::optional<double>& f) { return f ? three_digits(*f) : ""; };
  for (const auto& x : c.crossings) {
    // By its size: how far L is from -1. What is negative lies on the other side than the crossing itself.
    const double side = x.phase_margin_deg < 0.0 ? -1.0 : 1.0;
    const auto degrees = [side](const std::optional<double>& m) {
      return m ? fmt::format("{:.1f}", side * *m) : std::string();
    };
    const auto& from = side < 0.0 ? x.phase_margin_high_deg : x.phase_margin_low_deg;
    const auto& to = side < 0.0 ? x.phase_margin_low_deg : x.phase_margin_high_deg;
    const double turn = x.phase_margin_deg > 0.0 ? x.phase_margin_deg : x.phase_margin_deg + 360.0;
    table.rows.push_back({hertz(x.frequency_hz), hertz(x.frequency_low_hz), hertz(x.frequency_high_hz),
                          x.falling ? "falls" : "rises", side < 0.0 ? "above" : "below",
                          degrees(x.phase_margin_deg), degrees(from), degrees(to),
                          degrees(x.phase_margin_worst_deg),
                          three_digits(1e3 * turn / 360.0 / x.frequency_hz)});
  }
  for (std::size_t k = table.columns.size(); k-- > 0;) {
    const auto at = static_cast<std::ptrdiff_t>(k);
    if (std::ranges::any_of(table.rows, [&](const auto& row) { return !row[k].empty(); })) continue;
    table.columns.erase(table.columns.begin() + at);
    for (auto& row : table.rows) row.erase(row.begin() + at);
  }
  return table;
}

Table schedule_table(const Tuning& t) {
  Table table{"Gains over position", {"position", "kp", "ki", "Ti in ms", "exceeds, %"}, {}};
  if (!t.schedule) return table;
  const auto& places = t.schedule->places;
  for (const auto& n : t.schedule->nodes) {
    const auto place = std::find_if(places.begin(), places.end(),
                                    [&](const auto& p) { return std::abs(p.position - n.position) < 1e-9; });
    table.rows.push_back({fmt::format("{:.4g}", n.position), three_digits(n.kp), three_digits(n.ki),
                          n.ki > 0.0 ? three_digits(1e3 * n.kp / n.ki) : "",
                          place == places.end() ? "" : percent_cell(place->probability)});
  }
  return table;
}

Table shaper_table(const Tuning& t) {
  Table table{"Input shapers", {"shaper", "length in ms", "vibration left at 95 %, in %", ""}, {}};
  for (const auto& s : t.shapers)
    table.rows.push_back({s.kind, three_digits(1e3 * s.duration_s),
                          s.duration_s > 0.0 ? percent_cell(s.vibration) : "", s.chosen ? "chosen" : ""});
  return table;
}

std::string trust_text(const Tuning& t) {
  if (t.trusted) return "Trusted.";
  if (t.options.force) return "FORCED, and NOT trusted.";
  if (!t.proposed().stable && !stability_is_unknown(t)) return "NOT trusted: the loop is UNSTABLE.";
  return results_are_trusted(t) ? "Bounds NOT kept." : "NOT trusted: see the findings.";
}

std::string summary_text(const Tuning& t) {
  std::string text;
  for (const auto& sentence : sentences(t)) text += wrapped(sentence, "", "  ") + "\n";
  const auto& c = t.proposed();
  auto figures = figure_table(c);
  figures.title = fmt::format("{}: figures of {}", c.name, machine_words(t));
  if (is_for_several(t)) figures.title += fmt::format(", worst of all {}", t.machines.size());
  if (c.stable) text += table_text(figures);  // those of an unstable loop mean nothing
  if (c.stable && c.crossings.size() > 1) text += table_text(crossing_table(c));
  if (t.check) text += table_text(check_table(*t.check));
  const auto all = candidate_table(t);
  if (all.rows.size() > 1) {
    text += table_text(without(all, "remark"));
    for (const auto& row : all.rows)
      if (!row.back().empty()) text += wrapped(row.front() + ": " + row.back(), "  ", "    ") + "\n";
  }
  if (t.schedule) text += table_text(schedule_table(t));
  if (!t.shapers.empty()) text += table_text(shaper_table(t));
  text += "\n" + wrapped(machine_line(t), "", "  ") + "\n" + findings_text(t.findings);
  return text + "\n" + trust_text(t) + "\n";
}

nlohmann::json controller_json(const TunedController& c) {
  nlohmann::json j{{"numerator", c.feedback.numerator},
                   {"denominator", c.feedback.denominator},
                   {"sample_time_s", c.feedback.sample_time_s},
                   {"structure", c.structure}};
  if (!c.reference_numerator.empty()) j["reference_numerator"] = c.reference_numerator;
  if (c.position_gain) j["position_gain"] = *c.position_gain;
  if (!c.gains) return j;
  auto& gains = j["gains"] = {{"kp", c.gains->kp}, {"ki", c.gains->ki}};
  for (const auto& b : c.gains->biquads)
    gains["biquads"].push_back({{"frequency_hz", b.frequency_hz},
                                {"numerator_damping", b.numerator_damping},
                                {"denominator_damping", b.denominator_damping}});
  if (c.set_point_weight != 1.0) j["set_point_weight"] = c.set_point_weight;
  if (c.derivative_gain && c.derivative_time_s) {
    j["derivative_gain"] = *c.derivative_gain;
    j["derivative_time_s"] = *c.derivative_time_s;
  }
  return j;
}

namespace {

/// With what a reader of the file must know, and what its gains are in the recording's own units.
nlohmann::json controller_file(const Tuning& t, const TunedController& c) {
  auto j = controller_json(c);
  if (!t.trusted) j["warning"] = "this design is not trusted; do not run it before its findings are cured";
  if (const auto own = own_gains(t))
    j["recorded_units"] = {{"input", t.input_unit}, {"output", t.output_unit}, {"gain", own->factor}};
  return j;
}

}  // namespace

expected<nlohmann::json> controller_json(const Tuning& t) {
  if (const auto checked = check_exportable(t); !checked) return tl::unexpected(checked.error());
  if (const auto checked = check_exportable(t.options, identification::ExportFormat::json); !checked)
    return tl::unexpected(checked.error());
  return controller_file(t, t.proposed());
}

expected<nlohmann::json> first_step_json(const Tuning& t) {
  if (const auto checked = check_exportable(t); !checked) return tl::unexpected(checked.error());
  const auto soft = identification::first_step(t);
  if (!soft) return tl::unexpected(soft.error());
  return controller_file(t, *soft);
}

}  // namespace resonid::report
