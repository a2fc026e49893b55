// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <reproduce/reproduction.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/response/welch.hpp>

#include "reproduce/i_design.hpp"
#include "reproduce/runs.hpp"
#include "reproduce/spread.hpp"

namespace resonid::reproduction {
namespace {

using report::Section;
using Mark = report::Curve::Mark;
using Values = std::vector<std::complex<double>>;

constexpr double kLow_hz = 2.0, kHigh_hz = 33.0;
constexpr int kOrder = 3;

/// One noisy run and what was estimated from it.
struct Estimates {
  data::FrequencyResponse spectra;  ///< Averaged, direct.
  fit::BlackBoxFit published;       ///< OE of order 3, noise taken for white.
  fit::BlackBoxFit indirect;        ///< The same through the known controller.
  fit::OutputErrorFit physical;
};

plant::Simulation run_of(std::uint64_t seed, std::span<const double> grid = {}) {
  auto config = io::shipped_experiment("i_prbs");
  config.run.seed = seed;
  return simulated(config, grid);
}

fit::BlackBoxConfig black_box(const plant::Truth& truth, double rate_hz, int order) {
  fit::BlackBoxConfig config;
  config.order = order;
  config.delay_samples = static_cast<std::size_t>(std::lround(truth.delay_s * rate_hz));
  config.known_delay_s = truth.delay_s;
  config.noise_model = false;
  return config;
}

Estimates estimate(const plant::Simulation& run) {
  const auto& record = run.record;
  Estimates e;
  response::WelchConfig welch;
  welch.segment_samples = 1024;
  response::ResponseOptions options;
  options.approach = Approach::direct;
  options.delay_s = run.truth.delay_s;
  e.spectra = response::welch(record, welch, options).value();

  auto config = black_box(run.truth, record.sample_rate_hz, kOrder);
  e.published = fit::fit_black_box(record, config).value();
  config.predictor = fit::Predictor::closed_loop;
  config.controller = run.truth.controller;
  config.noise_model = true;
  e.indirect = fit::fit_black_box(record, config).value();

  fit::ResponseFitConfig start;
  start.sample_time_s = record.sample_time_s();
  start.low_hz = kLow_hz;
  start.high_hz = kHigh_hz;
  fit::OutputErrorConfig physical;
  physical.initial = fit::fit_response(e.spectra, start).value().model;
  physical.known_delay_s = run.truth.delay_s;
  e.physical = fit::fit_output_error(record, physical).value();
  return e;
}

double relative_rms(const Values& g, const Values& truth) {
  double sum = 0.0;
  for (std::size_t i = 0; i < g.size(); ++i) sum += std::norm(g[i] / truth[i] - 1.0);
  return 100.0 * std::sqrt(sum / static_cast<double>(g.size()));
}

/// Undamped frequency of the oscillating root, as z = exp(s Ts); not a number where there is none.
double mode_hz(const std::vector<fit::UncertainRoot>& roots, double sample_time_s) {
  for (const auto& root : roots)
    if (root.value.imag() > 1e-9) return std::abs(std::log(root.value)) / (kTwoPi * sample_time_s);
  return std::nan("");
}

// --- What was identified --------------------------------------------------------------------------------

struct Errors {
  std::vector<double> response, resonance, antiresonance, fit;
};

void add(Errors& e, const Values& g, const plant::Truth& truth, double resonance, double antiresonance,
         double fit_percent) {
  e.response.push_back(relative_rms(g, truth.response.value));
  e.resonance.push_back(100.0 * (resonance / truth.resonances.front().frequency_hz - 1.0));
  e.antiresonance.push_back(100.0 * (antiresonance / truth.antiresonances.front().frequency_hz - 1.0));
  e.fit.push_back(fit_percent);
}

report::ComparisonTable table_of(std::string title, const Errors& e) {
  report::ComparisonTable table{std::move(title), {}};
  table.rows = {row("rms error of the response, 2 ... 33 Hz", "%", spread(e.response)),
                row("error of the resonance", "%", spread(e.resonance), 0.0),
                row("error of the anti-resonance", "%", spread(e.antiresonance), 0.0),
                row("fit of the simulated velocity", "%", spread(e.fit))};
  return table;
}

struct Found {
  Section section;
  Spread published, physical;  ///< Error of the response.
  fit::DriveModel machine;
  i::Identified models;
};

report::Chart bode(const Estimates& e, const plant::Truth& truth, const std::vector<double>& grid) {
  const auto decibel = [](const Values& values) {
    std::vector<double> db;
    for (const auto& v : values) db.push_back(20.0 * std::log10(std::abs(v)));
    return db;
  };
  report::Chart chart;
  chart.title = "Response from torque to velocity";
  chart.x_label = "frequency (Hz)";
  chart.y_label = "magnitude (dB, 0 dB = 1 (rad/s)/Nm)";
  chart.log_x = true;
  const auto spectra = e.spectra.band(kLow_hz, kHigh_hz);
  chart.curves = {
      {"true", Mark::line, grid, decibel(truth.response.value)},
      {"output error, order 3", Mark::dashed, grid, decibel(e.published.model.response(grid).value)},
      {"averaged spectra", Mark::points, spectra.frequency_hz, decibel(spectra.value)}};
  chart.caption = "Seed 1.";
  return chart;
}

Found identified(std::size_t seeds, const std::function<void(double)>& progress) {
  const auto grid = grid_hz(kLow_hz, kHigh_hz, 0.5);
  Errors published, indirect, physical;
  Found result;
  auto& section = result.section;
  section.title = "Identified models";
  section.text = {
      "The published method: a discrete output-error model, B/A of order 3 behind the known delay, fitted to "
      "torque and velocity directly, the noise being white. Beside it the same model through the known "
      "controller, where torque enters as the loop makes it from the excitation, and the machine's own "
      "parameters J1, J2, K and D."};
  for (std::size_t seed = 1; seed <= seeds; ++seed) {
    const auto run = run_of(seed, grid);
    const auto e = estimate(run);
    const double step = run.record.sample_time_s();
    for (auto [errors, fit] : {std::pair(&published, &e.published), std::pair(&indirect, &e.indirect)})
      add(*errors, fit->model.response(grid).value, run.truth, mode_hz(fit->model.poles(), step),
          mode_hz(fit->model.zeros(), step), fit->fit_percent);
    add(physical, e.physical.model.values(grid), run.truth, e.physical.model.resonance().value,
        e.physical.model.antiresonance().value, e.physical.fit_percent);
    result.models.published.push_back(
        i::read_as_two_masses(e.published.model.response(grid), step, run.truth.delay_s));
    result.models.physical.push_back(e.physical.model);
    if (seed == 1) {
      section.charts.push_back(bode(e, run.truth, grid));
      result.machine = i::machine_of(run.truth, step);
    }
    progress(static_cast<double>(seed) / static_cast<double>(seeds));
  }
  section.tables = {table_of("Output error of order 3, direct, as published", published),
                    table_of("Output error of order 3 through the known controller", indirect),
                    table_of("The machine's own parameters, direct", physical)};
  result.published = spread(published.response);
  result.physical = spread(physical.response);
  return result;
}

}  // namespace

report::Document publication_i(const Options& options) {
  const auto progress = [&](double done) {
    if (options.progress) options.progress(done);
  };
  auto found = identified(options.seeds, [&](double part) { progress(0.5 * part); });
  report::Document document;
  document.title =
      "Publication I: off-line output error of a belt drive under a PRBS, and a controller from it";
  document.command = fmt::format("resonid reproduce i --seeds {}", options.seeds);
  document.seeds = options.seeds;
  document.summary = {
      fmt::format(
          "The published method works: 10 s of PRBS on the torque reference of a soft closed loop give a "
          "response that is off by {:.2f} % rms from 2 to 33 Hz, directly and without bias, since the "
          "noise is white as the method assumes.",
          found.published.mean),
      fmt::format(
          "Two parameters fewer are the better model: the machine's own J1, J2, K and D bring that to "
          "{:.2f} %.",
          found.physical.mean),
      "Publication I is not reprinted in the source, and there are no published figures to hold against."};
  document.sections = {std::move(found.section), i::design_section(found.machine, found.models)};
  document.discrepancies = {
      {"The whole publication", "not reprinted; a mass-flow model of its own",
       "system 2 of table 2.1 with the controller, delay and rate of Publication VI; experiments/i_prbs.toml",
       "The source describes the identification in words only and keeps to the two-mass model afterwards."}};
  progress(1.0);
  return document;
}

}  // namespace resonid::reproduction
