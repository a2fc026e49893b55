// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>

#include "report/document/tune_words.hpp"
#include "report/pages/curves.hpp"
#include "report/pages/tune_charts.hpp"

namespace resonid::report {
namespace {

using identification::TunedController;
using identification::Tuning;

Curve timed(const std::string& name, const std::vector<double>& time, const std::vector<double>& y) {
  const double rate =
      time.size() > 1 ? static_cast<double>(time.size() - 1) / (time.back() - time.front()) : 1.0;
  return thinned(name, y, time.front(), rate);
}

/// Where 95 % of |L| (in dB) and of its phase lie, at the lines that the curves show.
void put_bands(const data::FrequencyResponse& loop, Curve& size_db, Curve& phase) {
  constexpr double kWidth = 1.96, kLeast = 1e-3;  // of |L|: a band that ends there is endless in dB
  Curve bands;
  std::vector<double> turn;
  for (std::size_t i = 0; i < loop.lines(); ++i) {
    if (!std::binary_search(size_db.x.begin(), size_db.x.end(), loop.frequency_hz[i])) continue;
    const double size = std::abs(loop.value[i]);
    const double half = kWidth * loop.std[i] / std::sqrt(2.0);  // one direction of the plane
    bands.lower.push_back(20.0 * std::log10(std::max(size - half, kLeast * size)));
    bands.upper.push_back(20.0 * std::log10(size + half));
    turn.push_back(half < size ? std::asin(half / size) * 360.0 / kTwoPi : 180.0);
  }
  if (turn.size() != size_db.x.size() || turn.size() != phase.x.size()) return;
  size_db.lower = std::move(bands.lower);
  size_db.upper = std::move(bands.upper);
  for (std::size_t i = 0; i < turn.size(); ++i) {
    phase.lower.push_back(phase.y[i] - turn[i]);
    phase.upper.push_back(phase.y[i] + turn[i]);
  }
}

/// The phase of a loop, which lags, begins between -330 and 30 degrees.
void put_on_usual_turn(Curve& phase) {
  constexpr double kUsual = -150.0, kTurn = 360.0;
  if (phase.y.empty()) return;
  const double by = kTurn * std::round((phase.y.front() - kUsual) / kTurn);
  for (double& degrees : phase.y) degrees -= by;
}

/// Velocity and torque of a run, and of the same under the running controller.
std::vector<Chart> charts_of_run(const Tuning& t, const identification::SimulatedRun& proposed) {
  Chart velocity, torque;
  velocity.title = fmt::format("Load, {}", proposed.what);
  velocity.y_label = "Velocity of the load in " + t.units.velocity;
  torque.title = fmt::format("Torque, {}", proposed.what);
  torque.y_label = "Torque in " + t.units.input;
  for (auto* chart : {&velocity, &torque}) chart->x_label = "Time in s";
  const auto put = [](Chart& chart, const std::string& name, const std::vector<double>& time,
                      const std::vector<double>& y, Curve::Mark mark) {
    if (y.size() != time.size() || time.empty()) return;
    chart.curves.push_back(timed(name, time, y));
    chart.curves.back().mark = mark;
  };
  const double end = proposed.time_s.back();
  for (const auto& run : t.simulated) {
    const auto name = name_of_run(run);
    if (name.what != proposed.what) continue;
    auto cut = run;  // one that settles later is shown as long as the proposed one
    const auto shown = static_cast<std::size_t>(std::upper_bound(run.time_s.begin(), run.time_s.end(), end) -
                                                run.time_s.begin());
    for (auto* list : {&cut.time_s, &cut.velocity, &cut.torque})
      if (list->size() > shown) list->resize(shown);
    const auto mark = name.running ? Curve::Mark::dashed : Curve::Mark::line;
    const std::string who = name.running ? "running controller" : t.proposed().name;
    put(velocity, who, cut.time_s, cut.velocity, mark);
    put(torque, who, cut.time_s, cut.torque, mark);
  }
  put(velocity, "reference", proposed.time_s, proposed.reference, Curve::Mark::line);
  return {std::move(velocity), std::move(torque)};
}

}  // namespace

Section schedule_section(const Tuning& t) {
  Section s;
  s.title = "Gains over position";
  if (!t.schedule) return s;
  Curve kp{"kp", Curve::Mark::line, {}, {}}, ki{"ki", Curve::Mark::line, {}, {}};
  for (const auto& n : t.schedule->nodes) {
    kp.x.push_back(n.position);
    kp.y.push_back(n.kp);
    ki.x.push_back(n.position);
    ki.y.push_back(n.ki);
  }
  const auto units = gain_units(t.units.input, t.units.velocity);
  for (const auto& [curve, unit] : {std::pair{&kp, units.kp}, {&ki, units.ki}}) {
    Chart chart;
    chart.title = curve == &kp ? "Proportional gain" : "Integral gain";
    chart.x_label = "Position";
    chart.y_label = curve->name + (unit.empty() ? "" : " in " + unit);
    auto nodes = *curve;
    nodes.name = "nodes";
    nodes.mark = Curve::Mark::points;
    chart.curves = {*curve, std::move(nodes)};
    s.charts.push_back(std::move(chart));
  }
  if (!t.schedule->places.empty()) {
    Curve share{"exceeds a bound", Curve::Mark::line, {}, {}},
        allowed{"allowed", Curve::Mark::dashed, {}, {}};
    for (const auto& place : t.schedule->places) {
      for (Curve* curve : {&share, &allowed}) curve->x.push_back(place.position);
      share.y.push_back(100.0 * place.probability);
      allowed.y.push_back(100.0 * (1.0 - t.options.confidence));
    }
    Chart chart;
    chart.title = "Machines that exceed a bound";
    chart.x_label = "Position";
    chart.y_label = "share in %";
    chart.curves = {std::move(share), std::move(allowed)};
    s.charts.push_back(std::move(chart));
  }
  s.text = {
      "Linear between the nodes, constant beyond the ends; figures are the largest over the stroke, "
      "with the position fixed."};
  s.side_by_side = true;
  TunedController over_stroke;
  over_stroke.figures = t.schedule->figures;
  s.plain_tables = {schedule_table(t)};
  if (!over_stroke.figures.empty()) {
    s.plain_tables.push_back(figure_table(over_stroke));
    s.plain_tables.back().title = "Figures over the stroke";
  }
  return s;
}

Section simulated_section(const Tuning& t) {
  Section s;
  s.title = "On the simulated machine";
  s.side_by_side = true;
  Table table{"Promised and simulated", {"run", "figure", "promised", "simulated"}, {}};
  for (const auto& run : t.simulated) {
    const auto& controller = name_of_run(run).running && t.running ? *t.running : t.proposed();
    for (const auto& figure : run.figures) {
      const auto unit = shown_unit({figure.name, figure.unit, figure.simulated, {}, {}, {}, {}, {}, {}});
      table.rows.push_back({run_words(t, run),
                            loop_figure_words(figure.name, controller.position_gain.has_value()) +
                                (unit.unit.empty() ? "" : ", " + unit.unit),
                            figure.promised ? unit.number(*figure.promised) : "",
                            unit.number(figure.simulated)});
    }
    if (run.time_s.empty() || name_of_run(run).running) continue;
    for (auto& chart : charts_of_run(t, run))
      if (!chart.curves.empty()) s.charts.push_back(std::move(chart));
  }
  if (!table.rows.empty()) s.plain_tables = {std::move(table)};
  return s;
}

Section check_section(const Tuning& t) {
  Section s;
  s.title = "Checked on the machine";
  if (!t.check) return s;
  const auto& check = *t.check;
  s.side_by_side = true;
  s.plain_tables = {check_table(check)};
  if (check.frequency_hz.empty()) return s;
  data::FrequencyResponse promised, measured;
  promised.frequency_hz = measured.frequency_hz = check.frequency_hz;
  promised.value = check.predicted;
  measured.value = check.measured;
  promised.std = check.predicted_std;
  measured.std = check.measured_std;
  BodeCharts bode;
  bode.magnitude.title = "Open loop L: magnitude";
  bode.phase.title = "Open loop L: phase";
  bode.add_measured("measured", measured, Curve::Mark::points);
  put_on_usual_turn(bode.phase.curves.back());
  if (measured.std.size() == measured.lines())
    put_bands(measured, bode.magnitude.curves.front(), bode.phase.curves.front());
  bode.add_model("promised", promised);
  put_on_usual_turn(bode.phase.curves.back());
  if (promised.std.size() == promised.lines())
    put_bands(promised, bode.magnitude.curves.back(), bode.phase.curves.back());
  s.text = {"Bands: 95 % of what the error bars of the recording and of the promise leave, line by line."};
  s.charts = {std::move(bode.magnitude), std::move(bode.phase)};
  return s;
}

}  // namespace resonid::report
