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

/// What would have been noticed.
std::string seen_text(const identification::TuningCheck& check) {
  if (!check.detectable_gain || !check.detectable_delay_s) return {};
  return fmt::format(" A gain that differs by {} % or a delay by {} ms would have shown.",
                     three_digits(100.0 * *check.detectable_gain),
                     three_digits(1e3 * *check.detectable_delay_s));
}

/// A bound that the recording shows to be broken.
std::string beyond_text(const identification::Tuning& t) {
  std::string text;
  for (const auto& finding : t.findings)
    if (finding.id == "measured-beyond-bound" && finding.value && finding.threshold)
      text += fmt::format(" |S| measures {}, beyond its bound of {}.", three_digits(*finding.value),
                          three_digits(*finding.threshold));
  return text;
}

/// The figure that agrees least, where by itself it would hardly agree.
std::string doubtful_text(const identification::TuningCheck& check) {
  const identification::CheckedFigure* least = nullptr;
  for (const auto& figure : check.figures)
    if (figure.probability && (least == nullptr || *figure.probability < *least->probability))
      least = &figure;
  const auto compared =
      std::ranges::count_if(check.figures, [](const auto& figure) { return figure.probability.has_value(); });
  if (least == nullptr || *least->probability * static_cast<double>(compared) > 1.0 - kConfidence) return {};
  const auto unit = shown_unit({least->name, least->unit, least->predicted.value, {}, {}, {}, {}, {}, {}});
  return fmt::format(
      " Nearest to the edge of that is the {}: {} measured, {} promised{} (probability by noise {}).",
      loop_figure_words(least->name), three_digits(unit.factor * least->measured.value),
      three_digits(unit.factor * least->predicted.value),
      unit.unit.empty() ? std::string() : ", in " + unit.unit, chance_text(*least->probability));
}

/// A bound that the recording by itself does not show to be kept: its error bar is wider than the room.
std::string open_margin_text(const identification::Tuning& t) {
  constexpr double kWidth = 1.96;
  const auto* bounded = t.proposed().figure("sensitivity_peak");
  if (bounded == nullptr || !bounded->bound) return {};
  for (const auto& figure : t.check->figures) {
    const double half = kWidth * figure.measured.std;
    if (figure.name != "sensitivity_peak" || !std::isfinite(half)) continue;
    if (figure.measured.value + half <= *bounded->bound || half <= *bounded->bound - figure.predicted.value)
      continue;
    return fmt::format(
        " By itself it does not show that |S| stays below {}: it measures {} +- {}, which is wider than the "
        "room "
        "that the design leaves.",
        three_digits(*bounded->bound), three_digits(figure.measured.value), three_digits(half));
  }
  return {};
}

/// What the recording shows; empty without one.
std::string shown_text(const identification::Tuning& t) {
  if (!t.check) return {};
  const auto& check = *t.check;
  const auto beyond = beyond_text(t);
  if (!check.decided)
    return fmt::format(
               "Checked on the machine: from {} it cannot be told whether the loop is as promised, as {}.",
               check.record, check.cause) +
           beyond;
  if (check.agrees) {
    const auto agrees = fmt::format(
        "Checked on the machine: the loop of {} is the one that was promised, within both error bars{}",
        check.record, beyond.empty() ? "." : ", and breaks a bound all the same:" + beyond);
    return agrees + doubtful_text(check) + seen_text(check) + (beyond.empty() ? open_margin_text(t) : "");
  }
  const std::string furthest =
      check.worst_line_hz > 0.0 ? fmt::format(", furthest at {} Hz", three_digits(check.worst_line_hz)) : "";
  std::string text = fmt::format(
      "Checked on the machine: the loop of {} is NOT the one that was promised{} (probability of that by "
      "noise "
      "{}).",
      check.record, furthest, chance_text(check.probability));
  if (!check.cause.empty()) text += fmt::format(" Likely cause: {}.", check.cause);
  return text + beyond;
}

}  // namespace

std::string check_sentence(const identification::Tuning& t) {
  std::string text = shown_text(t);
  for (const auto& finding : t.findings)
    if (finding.id == "checked-machine" && !text.empty()) text += " " + finding.meaning;
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
