// SPDX-License-Identifier: MIT
// Figures 8 and 9: Nyquist curves on and off line, and what the distances give over the filter's gain.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/io/shipped_experiments.hpp>

#include "reproduce/vi_loop.hpp"
#include "reproduce/vi_offline.hpp"
#include "reproduce/vi_page.hpp"

namespace resonid::reproduction::vi {
namespace {

using Mark = report::Curve::Mark;

constexpr std::array<double, 10> kLambdas{40.0, 28.0, 20.0, 16.0, 13.0, 10.0, 8.0, 6.0, 5.0, 4.0};

struct DataSet {
  std::string name;
  plant::ExperimentConfig experiment;
  std::uint64_t seed = 1;
};

std::vector<DataSet> data_sets() {
  const auto sweep = io::shipped_experiment("vi_chirp_tensioner_b");
  const auto wide = io::shipped_experiment("vi_chirp_tensioner_b_50hz");
  return {
      {"data set 1 (35 Hz)", sweep, 1}, {"data set 2 (35 Hz)", sweep, 2}, {"data set 3 (50 Hz)", wide, 3}};
}

data::FrequencyResponse estimated_loop(const data::Record& record, const Known& given, double lambda) {
  const TrackedSweep tracked(record, given, lambda);
  return published_loop(tracked.response(loop_grid_hz(kNoisyStepHz), Approach::direct), given);
}

/// Per quantity the value at each lambda.
using Course = std::array<std::vector<double>, kLoopQuantities>;

Course course(const DataSet& set) {
  const Known given = known(set.experiment);
  const auto record = run(set.experiment, set.seed);
  Course values;
  for (const double lambda : kLambdas) {
    const auto figures = loop_figures(estimated_loop(record, given, lambda));
    for (std::size_t q = 0; q < kLoopQuantities; ++q) values[q].push_back(figures[q]);
  }
  return values;
}

std::vector<double> alphas() {
  std::vector<double> alpha;
  for (const double lambda : kLambdas) alpha.push_back(1.0 / lambda);
  return alpha;
}

report::Chart empty_chart(LoopQuantity quantity) {
  report::Chart chart;
  const auto& name = kLoopNames[quantity];
  chart.title = fmt::format("Counterpart of figure 9: {}", name.name);
  chart.x_label = "alpha = 1/lambda (r = 1)";
  chart.y_label = name.unit.empty() ? std::string(name.name) : fmt::format("{} ({})", name.name, name.unit);
  return chart;
}

report::Curve curve(const std::string& name, std::vector<double> x, std::vector<double> y, Mark mark) {
  report::Curve c;
  c.name = name;
  c.mark = mark;
  c.x = std::move(x);
  c.y = std::move(y);
  return c;
}

/// Figure 8: the sweep's loop beside the one from averaged spectra.
report::Chart nyquist(const std::string& letter, const std::string& chirp_file,
                      const std::string& prbs_file) {
  const auto chirp = io::shipped_experiment(chirp_file);
  const auto prbs = io::shipped_experiment(prbs_file);
  const auto online = estimated_loop(run(chirp, 1), known(chirp), 8.0);
  const auto offline = published_loop(
      averaged_response(run(prbs, 1), known(prbs), Approach::joint).band(1.8, 33.0), known(prbs));
  report::Chart chart;
  chart.title = fmt::format("Counterpart of figure 8: Nyquist curves of configuration {}", letter);
  chart.x_label = "real part of L";
  chart.y_label = "imaginary part of L";
  chart.equal_axes = true;
  chart.curves = {plane_curve("true", Mark::line, true_loop(chirp, loop_grid_hz(kNoisyStepHz), false)),
                  plane_curve("on line, along the sweep", Mark::points, online),
                  plane_curve("off line, averaged spectra", Mark::dashed, offline)};
  const auto figures = loop_figures(online);
  chart.caption = fmt::format(
      "On line: fc {:.2f} Hz, Pm {:.1f} deg, Mm {:.3f}, f_res {:.1f} Hz, f_ares {:.1f} Hz. The delay is "
      "left out of L; lambda = 8, seed 1.",
      figures[kCrossover], figures[kPhaseMargin], figures[kModulusMargin], figures[kResonance],
      figures[kAntiresonance]);
  return chart;
}

/// How far all values of a quantity, over gains and data sets, are from its true value.
report::ComparisonTable from_truth(const std::vector<Course>& courses, const LoopFigures& truth) {
  report::ComparisonTable table;
  table.title = "Configuration B: rms distance from the truth over gains and data sets";
  for (std::size_t q = 0; q < kLoopQuantities; ++q) {
    std::vector<double> squares;
    for (const auto& c : courses)
      for (const double value : c[q]) squares.push_back(std::pow(value / truth[q] - 1.0, 2.0));
    table.rows.push_back(row(std::string(kLoopNames[q].name), "%", 100.0 * std::sqrt(spread(squares).mean)));
  }
  return table;
}

std::string summary(const report::ComparisonTable& distances) {
  const auto at = [&](LoopQuantity q) { return distances.rows[q].reproduced.value_or(0.0); };
  return fmt::format(
      "Over all gains and data sets of Figure 9 the resonance is within {:.1f} % (rms) of its true value "
      "and the anti-resonance within {:.1f} %, the crossover within {:.1f} % and the phase margin within "
      "{:.1f} %.",
      at(kResonance), at(kAntiresonance), at(kCrossover), at(kPhaseMargin));
}

}  // namespace

Part figure_9(const Options&) {
  Part part;
  auto& section = part.section;
  section.title = "Figures 8 and 9: distances over the filter's gain";
  section.text = {
      "Configuration B with the belt's tensioner, swept twice from 35 Hz and once from 50 Hz to 1.5 Hz in "
      "17 s, with noise of 0.1 rad/s; the distances of Figure 5 read for lambda = 4 ... 40. The source "
      "measured a real machine; its figure shows values in a picture only. Behind +- stands the standard "
      "deviation over the ten gains, not over seeds. B runs under its own PI where the source keeps A's "
      "(see the discrepancies)."};
  const auto sets = data_sets();
  const auto fine = grid_hz(1.2, 34.0, 0.001);
  const auto truth = loop_figures(true_loop(sets.front().experiment, fine, false));
  std::vector<Course> courses;
  for (const auto& set : sets) courses.push_back(course(set));
  report::ComparisonTable table;
  table.title = "Configuration B: mean and spread over lambda = 4 ... 40";
  for (std::size_t q = 0; q < kLoopQuantities; ++q) {
    auto chart = empty_chart(static_cast<LoopQuantity>(q));
    for (std::size_t i = 0; i < sets.size(); ++i) {
      table.rows.push_back(row(fmt::format("{}, {}", kLoopNames[q].name, sets[i].name),
                               std::string(kLoopNames[q].unit), spread(courses[i][q]), truth[q]));
      chart.curves.push_back(curve(sets[i].name, alphas(), courses[i][q], Mark::line));
    }
    chart.curves.push_back(
        curve("true", {1.0 / kLambdas.front(), 1.0 / kLambdas.back()}, {truth[q], truth[q]}, Mark::dashed));
    section.charts.push_back(std::move(chart));
  }
  section.tables.push_back(std::move(table));
  section.tables.push_back(from_truth(courses, truth));
  part.summary.push_back(summary(section.tables.back()));
  section.charts.push_back(nyquist("A", "vi_chirp_tensioner_a", "vi_prbs_tensioner_a"));
  section.charts.push_back(nyquist("B", "vi_chirp_tensioner_b", "vi_prbs_tensioner_b"));
  return part;
}

}  // namespace resonid::reproduction::vi
