// SPDX-License-Identifier: MIT
// Figure 3: the published estimator on both reference systems, its residuals, and what the printed f(t) does.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/io/shipped_experiments.hpp>

#include "reproduce/vi_page.hpp"

namespace resonid::reproduction::vi {
namespace {

using Mark = report::Curve::Mark;

/// What all tables of this figure need of one reference system.
struct System {
  std::string letter;
  plant::ExperimentConfig experiment;
  Known given;
  std::vector<double> grid = band_grid_hz();
  data::FrequencyResponse truth;
};

System make_system(const std::string& letter, const std::string& file) {
  System s;
  s.letter = letter;
  s.experiment = io::shipped_experiment(file);
  s.given = known(s.experiment);
  s.truth = true_response(s.experiment, s.grid);
  return s;
}

ResponseErrors noise_free_errors(const System& s, double lambda, FilterFrequency frequency) {
  const TrackedSweep tracked(run_without_noise(s.experiment), s.given, lambda, frequency);
  return errors(tracked.response(s.grid, Approach::direct), s.truth);
}

std::vector<ResponseErrors> noisy_errors(const System& s, double lambda, FilterFrequency frequency,
                                         std::size_t seeds) {
  std::vector<ResponseErrors> all;
  for (std::size_t seed = 1; seed <= seeds; ++seed) {
    const TrackedSweep tracked(run(s.experiment, seed), s.given, lambda, frequency);
    all.push_back(errors(tracked.response(s.grid, Approach::direct), s.truth));
  }
  return all;
}

/// The value of largest magnitude in each of `count` equal stretches: the outline of an oscillation.
report::Curve outline(std::string name, const std::vector<double>& x, double sample_rate_hz) {
  constexpr std::size_t kCount = 400;
  report::Curve c;
  c.name = std::move(name);
  const std::size_t length = std::max<std::size_t>(1, x.size() / kCount);
  for (std::size_t first = 0; first + length <= x.size(); first += length) {
    const auto begin = x.begin() + static_cast<std::ptrdiff_t>(first);
    const auto peak = std::max_element(begin, begin + static_cast<std::ptrdiff_t>(length),
                                       [](double a, double b) { return std::abs(a) < std::abs(b); });
    c.x.push_back(static_cast<double>(peak - x.begin()) / sample_rate_hz);
    c.y.push_back(*peak);
  }
  return c;
}

void add_residuals(report::Section& section, const System& s) {
  const double rate = s.experiment.run.sample_rate_hz;
  const TrackedSweep clean(run_without_noise(s.experiment), s.given, 8.0);
  const TrackedSweep noisy(run(s.experiment, 1), s.given, 8.0);
  const struct {
    TrackedSweep::Signal signal;
    const char* title;
    const char* unit;
  } charts[] = {{TrackedSweep::kExcitation, "Counterpart of figure 3 c: residual of the excitation", "Nm"},
                {TrackedSweep::kInput, "Counterpart of figure 3 d: residual of the torque", "Nm"},
                {TrackedSweep::kOutput, "Counterpart of figure 3 e: residual of the velocity", "rad/s"}};
  for (const auto& c : charts) {
    report::Chart chart;
    chart.title = fmt::format("{}, system {}", c.title, s.letter);
    chart.x_label = "time (s)";
    chart.y_label = fmt::format("z - H x ({})", c.unit);
    if (c.signal != TrackedSweep::kExcitation)
      chart.curves.push_back(outline("with noise", noisy.residual(c.signal), rate));
    chart.curves.push_back(outline("noise-free", clean.residual(c.signal), rate));
    chart.caption = "Newest sample minus its prediction; of every 21 samples the largest.";
    section.charts.push_back(std::move(chart));
  }
}

void add_responses(report::Section& section, const System& s) {
  const TrackedSweep clean(run_without_noise(s.experiment), s.given, 8.0);
  const TrackedSweep noisy(run(s.experiment, 1), s.given, 8.0);
  add_bode(section, fmt::format("Counterpart of figure 3 a, b: system {}", s.letter),
           {{"true", s.truth, Mark::line},
            {"with noise", noisy.response(s.grid, Approach::direct), Mark::points},
            {"noise-free", clean.response(s.grid, Approach::direct), Mark::dashed}},
           "Direct estimate Y/U along the sweep, filter with lambda = 8; noise of 0.1 rad/s, seed 1.");
}

/// |sum r e^{-jwt}| Ts of the excitation, and what a long linear sweep has in its band: A/(2 sqrt|m|), by the
/// method of stationary phase.
report::Chart excitation_content(const System& s) {
  const double rate = s.experiment.run.sample_rate_hz;
  const auto& e = s.experiment.excitation;
  report::Curve content;
  content.name = "excitation";
  content.x = grid_hz(0.5, 50.0, 0.1);
  content.y = spectrum(run_without_noise(s.experiment).excitation.samples, rate, content.x);
  report::Curve level;
  level.name = "A/(2 sqrt|m|)";
  level.mark = Mark::dashed;
  level.x = {e.to_hz, e.from_hz};
  level.y.assign(2, 0.5 * e.amplitude / std::sqrt(std::abs(e.from_hz - e.to_hz) / e.duration_s));
  report::Chart chart;
  chart.title = "Counterpart of figure 3 f: frequency content of the excitation";
  chart.x_label = "frequency (Hz)";
  chart.y_label = "magnitude of the Fourier transform (Nm s)";
  chart.curves = {std::move(content), std::move(level)};
  chart.caption = "The chirp of 1 Nm from 35 to 1.5 Hz in 17 s, the same for both systems.";
  return chart;
}

constexpr double kLagSamples = 17.0;  ///< Of the two-state filter with lambda = 8.

/// The published estimator read where the filter has come after the sweep.
report::ComparisonTable lag_made_good(const System& s) {
  report::ComparisonTable table;
  table.title = fmt::format("System {}: read {:g} samples later, the filter's lag", s.letter, kLagSamples);
  const TrackedSweep tracked(run_without_noise(s.experiment), s.given, 8.0);
  add_noise_free_rows(table, "lambda 8, direct",
                      errors(tracked.response(s.grid, Approach::direct, kLagSamples), s.truth));
  return table;
}

/// System B as the source ran it: under the controller of A.
report::ComparisonTable one_controller(const System& a, const System& b, std::size_t seeds) {
  System s = b;
  s.experiment.controller = a.experiment.controller;
  s.given = known(s.experiment);
  report::ComparisonTable table;
  table.title = "System B under the controller of A: error of the published estimator";
  add_noise_free_rows(table, "lambda 8, direct", noise_free_errors(s, 8.0, FilterFrequency::instantaneous));
  add_noisy_rows(table, "lambda 8, direct", noisy_errors(s, 8.0, FilterFrequency::instantaneous, seeds));
  return table;
}

/// The two-state filter has no place for a constant: the operating point must be known and taken out.
report::ComparisonTable operating_point_left(const System& s, double velocity) {
  auto record = run_without_noise(s.experiment);
  for (double& y : record.output.samples) y += velocity;
  const TrackedSweep tracked(record, s.given, 8.0);
  report::ComparisonTable table;
  table.title = fmt::format("System {}: the operating point of {:g} rad/s left in y", s.letter, velocity);
  add_noise_free_rows(table, "lambda 8, direct", errors(tracked.response(s.grid, Approach::direct), s.truth));
  return table;
}

}  // namespace

Part figure_3(const Options& options) {
  Part part;
  part.section.title = "Figure 3: responses estimated along the sweep";
  part.section.text = {
      "A chirp of 1 Nm from 35 to 1.5 Hz in 17 s is added to the torque of a drive that turns at 10 rad/s; "
      "the operating point is taken out of the velocity, for a two-state filter cannot do without that "
      "(last table). One two-state filter (lambda = 8) on each signal follows the chirp's instantaneous "
      "frequency; the response is Y/U, with the known 4 ms taken out.",
      "Each system has the PI that gives its own loop, delay included, the published 2.7 Hz and 63.5 deg: "
      "1.0360 Nms/rad and 0.1470 s for A, 0.7916 Nms/rad and 0.1474 s for B. The source keeps one "
      "controller for both; a table shows B under that of A.",
      "Errors are against the zero-order-hold response of the simulated plant, at 2 ... 33 Hz every 0.1 "
      "Hz. Of noisy runs each run's own largest error is taken, then the mean over the seeds."};
  const System a = make_system("A", "vi_chirp_a");
  const System b = make_system("B", "vi_chirp_b");
  for (const System* s : {&a, &b}) {
    report::ComparisonTable table;
    table.title = fmt::format("System {}: error of the published estimator", s->letter);
    const std::string name = "lambda 8, direct";
    const auto clean = noise_free_errors(*s, 8.0, FilterFrequency::instantaneous);
    add_noise_free_rows(table, name, clean);
    add_noisy_rows(table, name, noisy_errors(*s, 8.0, FilterFrequency::instantaneous, options.seeds));
    part.section.tables.push_back(std::move(table));
    auto later = lag_made_good(*s);
    const double without_lag = later.rows[3].reproduced.value();
    part.section.tables.push_back(std::move(later));
    part.summary.push_back(fmt::format(
        "System {}, noise-free: the published estimator is within {:.2f} dB and {:.1f} deg of the truth "
        "over 2 ... 33 Hz, within {:.2f} dB and {:.1f} deg above 5 Hz. The sweep and the filter's lag make "
        "this error, not noise: read {:g} samples later {:.1f} deg are left of the last.",
        s->letter, clean.decibel, clean.degree, clean.decibel_above_5hz, clean.degree_above_5hz, kLagSamples,
        without_lag));
    add_responses(part.section, *s);
  }
  add_residuals(part.section, a);
  add_residuals(part.section, b);
  part.section.charts.push_back(excitation_content(a));
  part.section.tables.push_back(one_controller(a, b, options.seeds));

  report::ComparisonTable printed;
  printed.title = "System A: the filter at the printed f(t) = m t/2 + f0";
  const auto wrong = noise_free_errors(a, 8.0, FilterFrequency::printed);
  add_noise_free_rows(printed, "printed f(t)", wrong);
  add_noisy_rows(printed, "printed f(t)", noisy_errors(a, 8.0, FilterFrequency::printed, options.seeds));
  part.section.tables.push_back(std::move(printed));
  part.section.tables.push_back(operating_point_left(a, 10.0));
  const TrackedSweep lost(run_without_noise(a.experiment), a.given, 8.0, FilterFrequency::printed);
  add_bode(part.section, "The printed f(t) as the filter's frequency, system A",
           {{"true", a.truth, Mark::line},
            {"printed f(t), noise-free", lost.response(a.grid, Approach::direct), Mark::dashed}},
           "Eq. (17) is right inside the cosine of eq. (16) only; the instantaneous frequency is f0 + m t.");
  part.summary.push_back(
      fmt::format("The printed f(t) = m t/2 + f0 as the filter's frequency fails: {:.1f} dB and {:.0f} deg "
                  "without noise. The instantaneous frequency f0 + m t is what works.",
                  wrong.decibel, wrong.degree));
  return part;
}

}  // namespace resonid::reproduction::vi
