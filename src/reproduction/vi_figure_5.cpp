// SPDX-License-Identifier: MIT
// Figure 5: margins and resonances of system A read off the estimated Nyquist curve by distances, for every
// reading of the printed controller and sweep that could have been meant.
#include <fmt/format.h>

#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/reproduction/experiments.hpp>
#include <utility>

#include "reproduction/vi_loop.hpp"
#include "reproduction/vi_page.hpp"

namespace resonid::reproduction::vi {
namespace {

using Mark = report::Curve::Mark;

constexpr LoopFigures kPublishedClean{2.7, 63.5, 0.958, 15.3, 10.7};
constexpr LoopFigures kPublishedNoisy{2.7, 61.3, 0.915, 15.5, 10.4};
constexpr double kNear = 0.01;  // relative: about what the printed digits and the figure's grid leave open

struct Configuration {
  std::string name;
  plant::ExperimentConfig experiment;
};

std::vector<Configuration> configurations() {
  const auto literal = [](double sample_rate_hz) {
    auto c = shipped_experiment("vi_chirp_a_literal");
    c.run.sample_rate_hz = sample_rate_hz;
    return c;
  };
  const auto ascending = [](plant::ExperimentConfig c) {
    std::swap(c.excitation.from_hz, c.excitation.to_hz);
    return c;
  };
  const auto exact = shipped_experiment("vi_chirp_a");
  return {{"literal PI, descending, 1 ms", literal(1000.0)},
          {"literal PI, descending, 2 ms", literal(500.0)},
          {"literal PI, descending, 0.5 ms", literal(2000.0)},
          {"literal PI, ascending, 1 ms", ascending(literal(1000.0))},
          {"exact PI, descending, 2 ms", exact},
          {"exact PI, ascending, 2 ms", ascending(exact)}};
}

data::FrequencyResponse estimated_loop(const data::Record& record, const Known& given, double step_hz) {
  const TrackedSweep tracked(record, given, 8.0);
  return published_loop(tracked.response(loop_grid_hz(step_hz), Approach::direct), given);
}

std::array<Spread, kLoopQuantities> noisy_figures(const plant::ExperimentConfig& experiment,
                                                  std::size_t seeds, double step_hz) {
  const Known given = known(experiment);
  std::array<std::vector<double>, kLoopQuantities> values;
  for (std::size_t seed = 1; seed <= seeds; ++seed) {
    const auto figures = loop_figures(estimated_loop(run(experiment, seed), given, step_hz));
    for (std::size_t q = 0; q < kLoopQuantities; ++q) values[q].push_back(figures[q]);
  }
  std::array<Spread, kLoopQuantities> result;
  for (std::size_t q = 0; q < kLoopQuantities; ++q) result[q] = spread(values[q]);
  return result;
}

/// The published figures and their reproduction in one configuration.
struct Outcome {
  LoopFigures clean{};
  std::array<Spread, kLoopQuantities> noisy{};
  LoopFigures truth{};       ///< Of the source's loop: delay left out.
  LoopFigures truth_real{};  ///< Of the real loop, delay included.

  [[nodiscard]] bool clean_agrees(std::size_t q) const {
    return std::abs(clean[q] - kPublishedClean[q]) <= kNear * kPublishedClean[q];
  }
  [[nodiscard]] bool noisy_agrees(std::size_t q) const {
    return std::abs(noisy[q].mean - kPublishedNoisy[q]) <=
           std::max(2.0 * noisy[q].deviation, kNear * kPublishedNoisy[q]);
  }
};

Outcome outcome(const plant::ExperimentConfig& experiment, std::size_t seeds) {
  Outcome o;
  o.clean = loop_figures(estimated_loop(run_without_noise(experiment), known(experiment), kCleanStepHz));
  o.noisy = noisy_figures(experiment, seeds, kNoisyStepHz);
  const auto fine = grid_hz(1.2, 34.0, 0.001);
  o.truth = loop_figures(true_loop(experiment, fine, false));
  o.truth_real = loop_figures(true_loop(experiment, fine, true));
  return o;
}

report::ComparisonTable table_of(const std::string& name, const Outcome& o) {
  report::ComparisonTable table;
  table.title = name;
  for (std::size_t q = 0; q < kLoopQuantities; ++q) {
    auto note = fmt::format("truth with the delay {:.{}f}", o.truth_real[q], q == kPhaseMargin ? 1 : 3);
    if (!o.clean_agrees(q)) note += "; more than 1 % from the print";
    table.rows.push_back(row(fmt::format("{}, noise-free", kLoopNames[q].name),
                             std::string(kLoopNames[q].unit), o.clean[q], o.truth[q], kPublishedClean[q],
                             note));
  }
  for (std::size_t q = 0; q < kLoopQuantities; ++q)
    table.rows.push_back(row(fmt::format("{}, noisy", kLoopNames[q].name), std::string(kLoopNames[q].unit),
                             o.noisy[q], o.truth[q], kPublishedNoisy[q],
                             o.noisy_agrees(q) ? "" : "more than 2 standard deviations from the print"));
  return table;
}

/// The noisy figures of one configuration read on other grids.
report::ComparisonTable other_grids(const Configuration& c, std::size_t seeds) {
  report::ComparisonTable table;
  table.title = c.name + ", noisy, read on other grids";
  for (const double step_hz : {0.01, 0.02, kNoisyStepHz, 0.1}) {
    const auto figures = noisy_figures(c.experiment, seeds, step_hz);
    for (std::size_t q = 0; q < kLoopQuantities; ++q)
      table.rows.push_back(row(fmt::format("{}, every {:g} Hz", kLoopNames[q].name, step_hz),
                               std::string(kLoopNames[q].unit), figures[q], {}, kPublishedNoisy[q]));
  }
  return table;
}

/// Which of the five published figures a configuration gives, as words.
std::string reproduced(const Outcome& o, bool noisy) {
  std::string names;
  for (std::size_t q = 0; q < kLoopQuantities; ++q)
    if (noisy ? o.noisy_agrees(q) : o.clean_agrees(q)) {
      if (!names.empty()) names += ", ";
      names += kLoopNames[q].name;
    }
  return names.empty() ? "none" : names;
}

bool all_agree(const Outcome& o) {
  for (std::size_t q = 0; q < kLoopQuantities; ++q)
    if (!o.clean_agrees(q) || !o.noisy_agrees(q)) return false;
  return true;
}

report::Chart plane(const std::string& title, const Configuration& c, bool noisy) {
  const Known given = known(c.experiment);
  const auto loop = estimated_loop(noisy ? run(c.experiment, 1) : run_without_noise(c.experiment), given,
                                   noisy ? kNoisyStepHz : kCleanStepHz);
  const auto figures = loop_figures(loop);
  report::Chart chart;
  chart.title = title;
  chart.x_label = "real part of L";
  chart.y_label = "imaginary part of L";
  chart.equal_axes = true;
  report::Curve circle;
  circle.name = "unit circle";
  circle.mark = Mark::dashed;
  for (int i = 0; i <= 180; ++i) {
    circle.x.push_back(std::cos(kTwoPi * i / 180.0));
    circle.y.push_back(std::sin(kTwoPi * i / 180.0));
  }
  report::Curve critical;
  critical.name = "critical point";
  critical.mark = Mark::points;
  critical.x = {-1.0};
  critical.y = {0.0};
  chart.curves.push_back(
      plane_curve("true", Mark::line, true_loop(c.experiment, loop_grid_hz(kNoisyStepHz), false)));
  chart.curves.push_back(plane_curve("estimated", noisy ? Mark::points : Mark::dashed, loop));
  for (const std::size_t q :
       {std::size_t{kCrossover}, std::size_t{kAntiresonance}, std::size_t{kResonance}}) {
    if (!std::isfinite(figures[q])) continue;
    report::Curve point;
    point.name = fmt::format("{} = {:.2f} Hz", kLoopNames[q].name, figures[q]);
    point.mark = Mark::points;
    point.x = {loop.at(figures[q]).real()};
    point.y = {loop.at(figures[q]).imag()};
    chart.curves.push_back(std::move(point));
  }
  chart.curves.push_back(std::move(circle));
  chart.curves.push_back(std::move(critical));
  chart.caption = fmt::format("{}: fc {:.2f} Hz, Pm {:.1f} deg, Mm {:.3f}. The delay is left out of L.",
                              c.name, figures[kCrossover], figures[kPhaseMargin], figures[kModulusMargin]);
  return chart;
}

/// What each reading of "Kp = 10 1/s, Ti = 0.1 s" makes of the loop, the delay left out as published.
report::ComparisonTable readings() {
  struct Reading {
    const char* name;
    double gain;
    double integral_time_s;
  };
  constexpr Reading kReadings[] = {
      {"C = Kp (1 + Ti s)/s: 1.0 Nms/rad, 0.1 s", 1.0, 0.1},
      {"Kp (J1 + J2): 0.64 Nms/rad, 0.1 s", 0.64, 0.1},
      {"Kp times rated 11.55 Nm over 125.7 rad/s: 0.919 Nms/rad, 0.1 s", 0.919, 0.1},
      {"made for 2.7 Hz, 63.5 deg with the delay: 1.0360 Nms/rad, 0.1470 s", 1.03598193204, 0.147023908851},
      {"made for them without the delay: 1.0042 Nms/rad, 0.1220 s", 1.00423663125, 0.12202070349}};
  report::ComparisonTable table;
  table.title = "True loop of system A at 2 ms for each reading of the printed controller";
  const auto fine = grid_hz(1.2, 34.0, 0.001);
  for (const auto& reading : kReadings) {
    auto experiment = shipped_experiment("vi_chirp_a");
    experiment.controller.gain = reading.gain;
    experiment.controller.integral_time_s = reading.integral_time_s;
    const auto without = loop_figures(true_loop(experiment, fine, false));
    const auto with = loop_figures(true_loop(experiment, fine, true));
    for (const std::size_t q :
         {std::size_t{kCrossover}, std::size_t{kPhaseMargin}, std::size_t{kModulusMargin}}) {
      report::Comparison r;
      r.quantity = fmt::format("{}: {}", reading.name, kLoopNames[q].name);
      r.unit = kLoopNames[q].unit;
      r.published = kPublishedClean[q];
      r.truth = without[q];
      r.note = fmt::format("with the delay {:.{}f}", with[q], q == kPhaseMargin ? 1 : 3);
      table.rows.push_back(std::move(r));
    }
  }
  return table;
}

void summarise(Part& part, const std::vector<Configuration>& configurations,
               const std::vector<Outcome>& outcomes) {
  std::string whole;
  for (std::size_t i = 0; i < outcomes.size(); ++i) {
    if (all_agree(outcomes[i])) whole = configurations[i].name;
    part.section.text.push_back(fmt::format("{}: reproduced without noise: {}; with noise: {}.",
                                            configurations[i].name, reproduced(outcomes[i], false),
                                            reproduced(outcomes[i], true)));
  }
  const auto& descending = outcomes[0];
  const auto& ascending = outcomes[3];
  part.summary.push_back(
      whole.empty()
          ? fmt::format(
                "No single configuration reproduces all ten published figures of Figure 5. The printed "
                "controller read as 1.0 Nms/rad and 0.1 s at 1 ms gives region I with the descending sweep "
                "(noise-free fc {:.2f} Hz, Pm {:.1f} deg, Mm {:.3f}; printed 2.7, 63.5, 0.958) and region II "
                "with an ascending one only (f_res {:.1f} Hz, f_ares {:.1f} Hz; printed 15.3, 10.7; "
                "descending {:.1f}, {:.2f}).",
                descending.clean[kCrossover], descending.clean[kPhaseMargin],
                descending.clean[kModulusMargin], ascending.clean[kResonance],
                ascending.clean[kAntiresonance], descending.clean[kResonance],
                descending.clean[kAntiresonance])
          : fmt::format("All ten published figures of Figure 5 are reproduced by: {}.", whole));
  part.summary.push_back(fmt::format(
      "The true loop with that controller has fc {:.2f} Hz and Pm {:.1f} deg ({:.1f} deg with the delay): "
      "the "
      "published {:.1f} deg is an estimate with {:+.1f} deg of error, not the design's value.",
      descending.truth[kCrossover], descending.truth[kPhaseMargin], descending.truth_real[kPhaseMargin],
      kPublishedClean[kPhaseMargin], descending.clean[kPhaseMargin] - descending.truth[kPhaseMargin]));
}

}  // namespace

Part figure_5(const Options& options) {
  Part part;
  part.section.title = "Figure 5: margins and resonances from distances in the Nyquist plane";
  part.section.text = {
      "System A, L = C G with the estimated G (direct, lambda = 8). As published the 4 ms are in the "
      "simulated "
      "loop but left out of L; true values of the same L stand beside, those with the delay in the notes. "
      "The "
      "modulus margin is the least distance in region I, as published, not the least of the whole curve.",
      "The rules take a first crossing and extremes, so noise moves them, and moves them differently on "
      "another "
      "grid, of which the source says nothing: here every 0.01 Hz without and every 0.04 Hz with noise; a "
      "table "
      "shows others. Ascending sweeps begin where the loop crosses 1, in the filter's transient: with noise "
      "their crossover scatters most.",
      "Published, noise-free: 2.7 Hz, 63.5 deg, 0.958, 15.3 Hz, 10.7 Hz; with noise: 2.7, 61.3, 0.915, 15.5, "
      "10.4. As reproduced counts what is within 1 %, with noise also what is within 2 standard deviations."};
  const auto all = configurations();
  std::vector<Outcome> outcomes;
  for (const auto& c : all) {
    outcomes.push_back(outcome(c.experiment, options.seeds));
    part.section.tables.push_back(table_of(c.name, outcomes.back()));
  }
  summarise(part, all, outcomes);
  part.section.tables.push_back(other_grids(all[0], options.seeds));
  part.section.tables.push_back(readings());
  part.section.charts.push_back(plane("Figure 5, noise-free", all[0], false));
  part.section.charts.push_back(plane("Figure 5, with noise", all[0], true));
  part.section.charts.push_back(plane("Figure 5, noise-free, ascending sweep", all[3], false));
  return part;
}

}  // namespace resonid::reproduction::vi
