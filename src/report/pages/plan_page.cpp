// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/report/detail/plan.hpp>

#include "report/document/plan_words.hpp"
#include "report/document/words.hpp"

namespace resonid::report {
namespace {

using planning::Experiment;
using planning::Plan;

/// "phase_margin" -> "phase margin"
std::string figure_words(std::string name) { return quantity_words(std::move(name)); }

Section figures_section(const Plan& plan) {
  Section s;
  s.title = "Expected accuracy";
  s.sheet = true;
  Table targets{
      "Targets and expectation, one standard deviation", {"figure", "target", "expected", "met"}, {}};
  const auto& x = plan.planned();
  for (std::size_t i = 0; i < x.targeted.size(); ++i) {
    auto wanted = x.targeted[i];
    wanted.std = wanted_of(plan, i);
    const bool met = x.targeted[i].std <= wanted.std * (1.0 + 1e-9);
    targets.rows.push_back(
        {figure_words(wanted.name), relative_text(wanted), relative_text(x.targeted[i]), met ? "yes" : "no"});
  }
  Table bars{"Predicted error bars on the nominal model, one standard deviation", {"figure", "value"}, {}};
  for (const auto& e : plan.experiments) bars.columns.push_back(std::string(type_words(e.type)));
  for (std::size_t f = 0; f < x.figures.size(); ++f) {
    bars.rows.push_back(
        {figure_words(x.figures[f].name), fmt::format("{:.4g} {}", x.figures[f].value, x.figures[f].unit)});
    for (const auto& e : plan.experiments) bars.rows.back().push_back(relative_text(e.figures[f]));
  }
  Table cost{"What it asks of the drive", {"quantity"}, {}};
  for (const auto& e : plan.experiments) cost.columns.push_back(std::string(type_words(e.type)));
  const auto row = [&](const char* name, auto&& value) {
    cost.rows.push_back({name});
    for (const auto& e : plan.experiments) cost.rows.back().push_back(value(e));
  };
  const auto number = [](double v) { return fmt::format("{:.4g}", v); };
  row("length in s", [&](const Experiment& e) { return number(e.duration_s); });
  row("length for all targets in s",
      [&](const Experiment& e) { return e.needed_s ? number(*e.needed_s) : std::string("out of sight"); });
  row("peak of the excitation in Nm", [&](const Experiment& e) { return number(e.peaks.excitation); });
  row("peak torque of the machine in Nm", [&](const Experiment& e) { return number(e.peaks.torque); });
  row("rms torque in Nm", [&](const Experiment& e) { return number(e.peaks.torque_rms); });
  row("peak velocity in rad/s", [&](const Experiment& e) { return number(e.peaks.velocity); });
  row("stroke in rad", [&](const Experiment& e) { return number(e.peaks.stroke); });
  row("limit that binds", [](const Experiment& e) { return e.binding; });
  s.plain_tables = {targets, bars, cost};
  s.text = {
      fmt::format("Accuracy targets are judged by what is expected over {} possible {}: the nominal model, "
                  "and its parameters moved by {:.0f} %.",
                  plan.drives, plan.drives == 1 ? "drive" : "drives", 100.0 * plan.config.spread)};
  return s;
}

Section spectrum_section(const Plan& plan) {
  Section s;
  s.title = "Where the power goes";
  const auto& x = plan.planned();
  Chart lines;
  lines.title = "Excitation and response";
  lines.x_label = "Frequency in Hz";
  lines.y_label = "Level in dB, 0 dB = 1 Nm, (rad/s)/Nm or Nm/Nm";
  std::vector<double> grid;
  const double low = plan.config.band_hz->first, high = plan.config.band_hz->second;
  for (int i = 0; i < 400; ++i) grid.push_back(low * std::pow(high / low, i / 399.0));
  const auto level = [](const std::vector<std::complex<double>>& values) {
    std::vector<double> db;
    for (const auto& v : values) db.push_back(20.0 * std::log10(std::abs(v)));
    return db;
  };
  const auto loop = planning::loop_response(plan.config.drive, grid);
  lines.log_x = true;
  lines.curves = {{"nominal model, torque to velocity", Curve::Mark::line, grid,
                   level(plan.config.drive.model.values(grid))},
                  {"excitation to torque", Curve::Mark::dashed, grid, level(loop.torque)}};
  if (!x.frequency_hz.empty()) {
    Curve stems{"amplitude of the lines", Curve::Mark::points, x.frequency_hz, {}};
    for (const double a : x.line_amplitude) stems.y.push_back(20.0 * std::log10(a));
    lines.curves.push_back(stems);
    lines.caption = "Strong lines carry the information; weak ones reduce the peaks.";
  }
  s.charts = {lines};
  return s;
}

Section waveform_section(const Plan& plan) {
  Section s;
  s.title = "In time";
  const auto& x = plan.planned();
  const auto motion = planning::simulate(plan.config.drive, x.excitation);
  constexpr std::size_t kMostShown = 4000;
  const std::size_t wanted = x.period_samples > 0 ? 2 * x.period_samples : x.excitation.size();
  const std::size_t shown = std::min({kMostShown, wanted, x.excitation.size()});
  std::vector<double> time;
  for (std::size_t k = 0; k < shown; ++k)
    time.push_back(static_cast<double>(k) * plan.config.drive.model.sample_time_s);
  const auto curve = [&](const char* name, const std::vector<double>& y) {
    return Curve{name, Curve::Mark::line, time, {y.begin(), y.begin() + static_cast<std::ptrdiff_t>(shown)}};
  };
  Chart torque, velocity, position;
  torque.title = "Excitation and torque";
  torque.y_label = "Torque in Nm";
  torque.curves = {curve("excitation", x.excitation), curve("torque of the machine", motion.torque)};
  velocity.title = "Velocity of the motor";
  velocity.y_label = "Velocity in rad/s";
  velocity.curves = {curve("velocity", motion.velocity)};
  position.title = "Position of the motor";
  position.y_label = "Position in rad";
  position.curves = {curve("position", motion.position)};
  s.charts = {torque, velocity, position};
  for (auto& chart : s.charts) chart.x_label = "Time in s";
  s.text = {x.period_samples > 0 ? "The first two periods on the nominal model, from rest, without noise."
                                 : "On the nominal model, from rest, without noise."};
  return s;
}

std::vector<Card> cards_of(const Plan& plan) {
  const auto& x = plan.planned();
  const auto number = [](double v) { return fmt::format("{:.3g}", v); };
  std::vector<Card> cards = {
      {"Length", number(x.duration_s), "s", {std::string(name_of(x.type))}},
      {"Excitation",
       number(x.peaks.excitation),
       "Nm",
       {fmt::format("peak, crest factor {:.3g}", x.crest_factor)}},
      {"Torque", number(x.peaks.torque), "Nm", {fmt::format("peak, {:.3g} Nm rms", x.peaks.torque_rms)}},
      {"Velocity", number(x.peaks.velocity), "rad/s", {"peak"}},
      {"Stroke", number(x.peaks.stroke), "rad", {"end to end"}}};
  // The figure that is hardest to reach.
  std::size_t worst = x.targeted.size();
  double most = 0.0;
  for (std::size_t i = 0; i < x.targeted.size(); ++i) {
    const double ratio = x.targeted[i].std / wanted_of(plan, i);
    if (ratio > most) {
      most = ratio;
      worst = i;
    }
  }
  if (worst < x.targeted.size()) {
    auto wanted = x.targeted[worst];
    wanted.std = wanted_of(plan, worst);
    const std::string text = relative_text(x.targeted[worst]);
    const auto space = text.find(' ');
    cards.push_back({"Error bar of " + figure_words(wanted.name),
                     text.substr(0, space),
                     space == std::string::npos ? "" : text.substr(space + 1),
                     {"target " + relative_text(wanted) + ", one standard deviation"}});
  }
  return cards;
}

}  // namespace

Document document(const Plan& plan) {
  Document d;
  d.kind = "plan";
  const auto& x = plan.planned();
  d.title = fmt::format("{} of {:.3g} s", type_words(x.type), x.duration_s);
  d.facts = {fmt::format("{} samples", x.excitation.size()),
             fmt::format("{:g} Hz", 1.0 / plan.config.drive.model.sample_time_s),
             fmt::format("{:.3g} ... {:.3g} Hz", plan.config.band_hz->first, plan.config.band_hz->second)};
  d.summary = sentences(plan);
  d.badge = Badge{plan.reached, plan.reached ? "All targets met" : "Targets not met",
                  plan.reached ? fmt::format("by a {} of {:.3g} s", type_words(x.type), x.duration_s)
                               : fmt::format("worst error bar {:.3g} times as wide as its target", x.ratio),
                  true};
  d.cards = cards_of(plan);
  d.sections = {figures_section(plan), spectrum_section(plan), waveform_section(plan)};
  return d;
}

}  // namespace resonid::report
