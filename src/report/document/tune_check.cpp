// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <cmath>
#include <resonid/base/detail/statistics.hpp>

#include "report/document/tune_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

constexpr double kConfidence = 0.95;

std::string checked_cell(const identification::CheckedFigure& figure, const data::Estimate& e) {
  const auto unit = shown_unit({figure.name, figure.unit, e.value, {}, {}, {}, {}, {}, {}});
  const double std = std::isfinite(e.std) ? e.std : 0.0;
  return with_error(unit.factor * e.value, unit.factor * two_sided_quantile(kConfidence) * std);
}

std::string chance_text(double probability) {
  return probability < 1e-4 ? "less than 0.0001" : fmt::format("{:.2g}", probability);
}

}  // namespace

std::string check_sentence(const identification::Tuning& t) {
  if (!t.check) return {};
  const auto& check = *t.check;
  if (check.agrees)
    return fmt::format(
        "Checked on the machine: the loop of {} is the one that was promised, within both error bars.",
        check.record);
  std::string text = fmt::format(
      "Checked on the machine: the loop of {} is NOT the one that was promised, furthest at {} Hz "
      "(probability of that by noise {}).",
      check.record, three_digits(check.worst_line_hz), chance_text(check.probability));
  if (!check.cause.empty()) text += fmt::format(" Likely cause: {}.", check.cause);
  return text;
}

Table check_table(const identification::TuningCheck& check) {
  Table table{"Promised and measured, 95 % confidence intervals",
              {"figure", "promised", "measured", "probability by noise"},
              {}};
  for (const auto& figure : check.figures) {
    const auto unit =
        shown_unit({figure.name, figure.unit, figure.predicted.value, {}, {}, {}, {}, {}, {}}).unit;
    table.rows.push_back({loop_figure_words(figure.name) + (unit.empty() ? "" : ", " + unit),
                          checked_cell(figure, figure.predicted), checked_cell(figure, figure.measured),
                          figure.probability ? chance_text(*figure.probability) : ""});
  }
  return table;
}

}  // namespace resonid::report
