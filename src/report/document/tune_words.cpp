// SPDX-License-Identifier: MIT
#include "report/document/tune_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace resonid::report {
namespace {

using identification::LoopFigure;
using identification::TunedController;
using identification::Tuning;

constexpr std::array kFigures = {
    FigureWords{"sensitivity_peak", "largest |S| (Ms)", "|S|"},
    FigureWords{"complementary_peak", "largest |T| (Mt)", "|T|"},
    FigureWords{"load_peak", "largest |T_load|", "|T_load|"},
    FigureWords{"controller_sensitivity_peak", "largest |C S|", "|C S|"},
    FigureWords{"process_sensitivity_peak", "largest |G S|", "|G S|"},
    FigureWords{"disk_peak", "largest |S - T|", "|S - T|"},
    FigureWords{"beyond_band_peak", "largest (1 + rho)|L| above the band", "|L| above the band"},
    FigureWords{"phase_margin_deg", "least phase margin", "phase margin"},
    FigureWords{"gain_margin_db", "gain margin", "gain margin"},
    FigureWords{"delay_margin_s", "delay margin", "delay margin"},
    FigureWords{"crossover_hz", "crossover", "crossover"},
    FigureWords{"load_bandwidth_hz", "bandwidth of the load", "bandwidth of the load"},
    FigureWords{"load_step_iae", "load step: IAE", "IAE of the load step"},
    FigureWords{"load_step_ie", "load step: IE", "IE of the load step"},
    FigureWords{"load_step_peak", "load step: peak", "peak of the load step"},
    FigureWords{"load_step_rebound", "load step: swing to the other side", "rebound of the load"},
    FigureWords{"position_error_during", "position error during it", "position error during it"},
    FigureWords{"position_error_after", "position error after it", "position error after it"},
    FigureWords{"noise_gain", "torque per velocity noise (rms)", "noise gain"},
    FigureWords{"deviation_left", "deviation of the load that is left", "deviation of the load that is left"},
    FigureWords{"reference_overshoot", "reference step: overshoot", "overshoot of the load"},
    FigureWords{"reference_settling_s", "reference step: settling", "settling of the load"},
    FigureWords{"reference_peak_torque", "reference step: peak torque", "peak torque"},
    FigureWords{"reference_rms_torque", "reference step: rms torque", "rms torque"}};

/// A cascade's load by the reference of its position.
constexpr FigureWords kPositionPeak = {"load_peak", "largest |T_position|", "|T_position|"};

const FigureWords* words_of(std::string_view name, bool of_position) {
  if (of_position && name == kPositionPeak.name) return &kPositionPeak;
  const auto* found =
      std::find_if(kFigures.begin(), kFigures.end(), [&](const FigureWords& w) { return w.name == name; });
  return found == kFigures.end() ? nullptr : found;
}

/// "2.7", "340": never with an exponent.
std::string two_digits(double value) {
  constexpr double kShort = 99.5;
  if (!(value >= kShort) || !std::isfinite(value)) return fmt::format("{:.2g}", value);
  const double step = std::pow(10.0, std::floor(std::log10(value)) - 1.0);
  return fmt::format("{:.0f}", step * std::round(value / step));
}

/// Behind what a load step does to a cascade's measured position.
const char* measured_position(std::string_view name, bool of_position) {
  const bool is_measured = name == "load_step_iae" || name == "load_step_ie" || name == "load_step_peak";
  return of_position && is_measured ? " of the measured position" : "";
}

std::string spaced(std::string_view name) {
  std::string text(name);
  std::replace(text.begin(), text.end(), '_', ' ');
  return text;
}

}  // namespace

std::string loop_figure_words(std::string_view name, bool of_position) {
  const auto* words = words_of(name, of_position);
  return words == nullptr ? spaced(name) : std::string(words->words) + measured_position(name, of_position);
}

std::string loop_figure_symbol(std::string_view name, bool of_position) {
  const auto* words = words_of(name, of_position);
  return words == nullptr ? spaced(name) : std::string(words->symbol) + measured_position(name, of_position);
}

std::string three_digits(double value) {
  constexpr double kWhole = 99.95, kLong = 1e5, kSmall = 1e-4;
  const double size = std::abs(value);
  if (!std::isfinite(value)) return value > 0.0 ? "infinite" : "unknown";
  if (size == 0.0) return "0";
  if (size >= kLong || size < kSmall) return fmt::format("{:.3g}", value);
  return size >= kWhole ? fmt::format("{:.0f}", value) : fmt::format("{:#.3g}", value);
}

std::string time_text(double seconds) {
  return std::abs(seconds) < 1.0 ? three_digits(1e3 * seconds) + " ms" : three_digits(seconds) + " s";
}

std::string grouped(std::size_t count) {
  std::string text = std::to_string(count);
  for (auto at = text.size(); at > 3 && text.size() > 4;) text.insert(at -= 3, 1, ' ');
  return text;
}

std::string share_text(double share) {
  const double percent = 100.0 * share;
  constexpr double kFew = 0.01, kMost = 99.5;  // where whole numbers would say none, or all
  if (percent > 0.0 && percent < kFew) return "less than 0.01 %";
  if (percent > 0.0 && percent < 9.95) return fmt::format("{:.2g} %", percent);
  if (percent >= kMost && percent < 100.0) return fmt::format("{:.2f} %", std::min(percent, 99.99));
  return fmt::format("{:.0f} %", percent);
}

std::string ShownUnit::number(double value) const {
  constexpr double kRounding = 1e-6;  // per cent of a step: below any sample
  const double shown = factor * value;
  return unit == "%" && std::abs(shown) < kRounding ? "0" : three_digits(shown);
}

std::string ShownUnit::text(double value) const { return number(value) + (unit.empty() ? "" : " " + unit); }

ShownUnit shown_unit(const LoopFigure& figure) {
  if (figure.unit == "s" && std::abs(figure.value) < 1.0) return {1e3, "ms"};
  const bool share = figure.name == "load_step_rebound" || figure.name == "reference_overshoot";
  if (share && figure.unit.empty()) return {100.0, "%"};
  return {1.0, figure.unit};
}

bool is_p(const TunedController& c) {
  return c.gains && c.gains->ki == 0.0 && !c.position_gain && !c.derivative_gain;
}

std::string gains_text(const TunedController& c, const GainUnits& units, double factor) {
  if (!c.gains) return {};
  const auto with = [](double value, const std::string& unit) {
    return three_digits(value) + (unit.empty() ? "" : " " + unit);
  };
  std::string text = "kp " + with(factor * c.gains->kp, units.kp);
  if (is_p(c)) return text;
  text += ", ki " + with(factor * c.gains->ki, units.ki);
  if (c.gains->ki > 0.0) text += fmt::format(" (Ti {})", time_text(c.gains->kp / c.gains->ki));
  return text;
}

std::optional<double> value_of(const TunedController& c, std::string_view name) {
  for (const auto& figure : c.figures)
    if (figure.name == name && std::isfinite(figure.value)) return figure.value;
  return std::nullopt;
}

std::string figure_text(const TunedController& c, std::string_view name) {
  for (const auto& figure : c.figures)
    if (figure.name == name) return shown_unit(figure).text(figure.value);
  return "unknown";
}

bool is_worst_alone(const LoopFigure& figure) {
  return figure.worst && *figure.worst == figure.value && !figure.low && !figure.probability;
}

bool stability_is_unknown(const Tuning& t) {
  return std::ranges::find(t.findings, "stability-not-told", &diagnostics::Finding::id) != t.findings.end();
}

bool results_are_trusted(const Tuning& t) {
  const auto& c = t.proposed();
  if (t.trusted) return true;
  if (c.within && c.stable) return false;
  return std::none_of(t.findings.begin(), t.findings.end(), [&](const auto& finding) {
    // An unstable loop is unstable in simulation, too.
    const bool is_known = !c.stable && finding.id == "fails-in-simulation";
    return finding.severity == diagnostics::Severity::error && finding.id != "bounds-exceeded" &&
           finding.id != "design-unstable" && finding.id != "stability-not-told" && !is_known;
  });
}

std::string unit_of_figure(const TunedController& c, std::string_view name) {
  for (const auto& figure : c.figures)
    if (figure.name == name) return figure.unit;
  return {};
}

bool are_alike(const TunedController& a, const TunedController& b) {
  return a.position_gain.has_value() == b.position_gain.has_value();
}

std::string left_out_sentence(const Tuning& t) {
  if (!t.running || are_alike(*t.running, t.proposed())) return {};
  return t.proposed().position_gain
             ? "The running controller closes a loop of velocity and is left out where that of position is "
               "shown: its load has another reference."
             : "The running controller closes a loop of position and is left out where that of velocity is "
               "shown: its load has another reference.";
}

std::optional<double> stiffer_by(const Tuning& t) {
  constexpr std::string_view kError = "load_step_iae";
  if (!t.running || !t.running->stable || !t.proposed().stable) return std::nullopt;
  // A position loop's error is one of position.
  if (unit_of_figure(*t.running, kError) != unit_of_figure(t.proposed(), kError)) return std::nullopt;
  const auto now = value_of(*t.running, kError), then = value_of(t.proposed(), kError);
  if (!now || !then || !(*now > 0.0) || !(*then > 0.0)) return std::nullopt;
  return *now / *then;
}

std::string stiffness_words(double ratio) {
  constexpr double kClearly = 0.05;
  if (ratio > 1.0 + kClearly) return two_digits(ratio) + " times stiffer";
  return ratio < 1.0 - kClearly ? two_digits(1.0 / ratio) + " times softer" : "as stiff";
}

bool is_for_several(const Tuning& t) { return t.machines.size() > 1 && !t.schedule; }

std::string file_of_machine(const Tuning& t, std::size_t i) {
  for (const auto* list : {&t.results, &t.files})
    if (list->size() == t.machines.size() && i < list->size() && !(*list)[i].empty()) return (*list)[i];
  return i == 0 ? "the first result" : fmt::format("result {}", i + 1);
}

std::string first_file(const Tuning& t) { return file_of_machine(t, 0); }

std::string machine_words(const Tuning& t) {
  if (t.by_response) return "the measured response";
  return is_for_several(t) ? "the machine of " + first_file(t) : "the identified machine";
}

std::string several_sentence(const Tuning& t) {
  if (!is_for_several(t)) return {};
  return fmt::format(
      "Figures and curves are those of {}; worst cases are those of all {} machines, shares those of the one "
      "that exceeds most often.",
      machine_words(t), t.machines.size());
}

std::string bounds_text(const TunedController& c) {
  std::string text;
  for (const auto& figure : c.figures) {
    if (!figure.bound) continue;
    const bool least =
        figure.name == "load_bandwidth_hz" || figure.name.find("_margin_") != std::string::npos;
    text += fmt::format("{}{} {} {}", text.empty() ? "" : ", ",
                        loop_figure_symbol(figure.name, c.position_gain.has_value()),
                        least ? ">=" : "<=", shown_unit(figure).text(*figure.bound));
  }
  return text;
}

}  // namespace resonid::report
