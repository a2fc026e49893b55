// SPDX-License-Identifier: MIT
// Figure 3: the published estimator on both reference systems, its residuals, and what the printed f(t) does.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <resonid/reproduction/experiments.hpp>

#include "reproduction/vi_page.hpp"

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
  s.experiment = shipped_experiment(file);
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
  } charts[] = {{TrackedSweep::kExcitation, "Figure 3 c: residual of the excitation", "Nm"},
                {TrackedSweep::kInput, "Figure 3 d: residual of the torque", "Nm"},
                {TrackedSweep::kOutput, "Figure 3 e: residual of the velocity", "rad/s"}};
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
  add_bode(section, fmt::format("Figure 3 a, b: system {}", s.letter),
           {{"true", s.truth, Mark::line},
            {"with noise", noisy.response(s.grid, Approach::direct), Mark::points},
            {"noise-free", clean.response(s.grid, Approach::direct), Mark::dashed}},
           "Direct estimate Y/U along the sweep, filter with lambda = 8; noise of 0.1 rad/s, seed 1.");
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
      "the operating point is taken out of the velocity, for a two-state filter cannot do without that (last "
      "table). One "
      "two-state filter (lambda = 8) on each signal "
      "follows the chirp's instantaneous frequency; the response is Y/U, with the known 4 ms taken out.",
      "Errors are against the zero-order-hold response of the simulated plant, at 2 ... 33 Hz every 0.1 Hz. "
      "Of noisy runs each run's own largest error is taken, then the mean over the seeds."};
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
    part.summary.push_back(fmt::format(
        "System {}, noise-free: the published estimator is within {:.2f} dB and {:.1f} deg of the truth "
        "over 2 ... 33 Hz, within {:.2f} dB and {:.1f} deg above 5 Hz: the sweep itself, not noise, makes "
        "this error.",
        s->letter, clean.decibel, clean.degree, clean.decibel_above_5hz, clean.degree_above_5hz));
    add_responses(part.section, *s);
  }
  add_residuals(part.section, a);
  add_residuals(part.section, b);

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
