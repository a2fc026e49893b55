// SPDX-License-Identifier: MIT
// Figure 4: the filter's lambda, the sweep's duration and its amplitude varied on system A.
#include <fmt/format.h>

#include <resonid/io/shipped_experiments.hpp>

#include "reproduce/vi_page.hpp"

namespace resonid::reproduction::vi {
namespace {

using Mark = report::Curve::Mark;

constexpr double kLambdas[] = {4.0, 8.0, 20.0, 40.0};
/// Sweeps of 5, 10, 17 and 34 s.
constexpr const char* kSweeps[] = {"vi_chirp_a_5s", "vi_chirp_a_10s", "vi_chirp_a", "vi_chirp_a_34s"};
constexpr double kAmplitudes[] = {0.5, 1.0, 2.0, 4.0};

plant::ExperimentConfig with_amplitude(double amplitude) {
  auto experiment = io::shipped_experiment("vi_chirp_a");
  experiment.excitation.amplitude = amplitude;
  return experiment;
}

struct Case {
  ResponseErrors clean;
  std::vector<double> noisy_rms;  ///< [seed], above 5 Hz
};

/// One case per lambda, from the same records.
std::vector<Case> cases(const plant::ExperimentConfig& experiment, std::span<const double> lambdas,
                        std::size_t seeds) {
  const Known given = known(experiment);
  const auto grid = band_grid_hz();
  const auto truth = true_response(experiment, grid);
  const auto measure = [&](const data::Record& record, double lambda) {
    return errors(TrackedSweep(record, given, lambda).response(grid, Approach::direct), truth);
  };
  std::vector<Case> all(lambdas.size());
  const auto clean = run_without_noise(experiment);
  for (std::size_t i = 0; i < lambdas.size(); ++i) all[i].clean = measure(clean, lambdas[i]);
  for (std::size_t seed = 1; seed <= seeds; ++seed) {
    const auto noisy = run(experiment, seed);
    for (std::size_t i = 0; i < lambdas.size(); ++i)
      all[i].noisy_rms.push_back(measure(noisy, lambdas[i]).rms_above_5hz);
  }
  return all;
}

void add_rows(report::ComparisonTable& table, const std::string& name, const Case& c) {
  table.rows.push_back(
      row(name + ": largest magnitude error above 5 Hz, noise-free", "dB", c.clean.decibel_above_5hz));
  table.rows.push_back(
      row(name + ": largest phase error above 5 Hz, noise-free", "deg", c.clean.degree_above_5hz));
  table.rows.push_back(row(name + ": rms relative error above 5 Hz, noisy", "", spread(c.noisy_rms)));
}

report::Chart error_chart(const std::string& title, const std::string& y_label) {
  report::Chart chart;
  chart.title = title;
  chart.x_label = "lambda";
  chart.y_label = y_label;
  chart.log_x = true;
  return chart;
}

void add_response_charts(report::Section& section, const plant::ExperimentConfig& experiment) {
  const Known given = known(experiment);
  const auto grid = band_grid_hz();
  const auto record = run(experiment, 1);
  std::vector<Named> responses{{"true", true_response(experiment, grid), Mark::line}};
  for (const double lambda : kLambdas)
    responses.push_back({fmt::format("lambda = {:g}", lambda),
                         TrackedSweep(record, given, lambda).response(grid, Approach::direct), Mark::dashed});
  add_bode(section,
           fmt::format("Counterpart of figure 4: system A, T = {:g} s", experiment.excitation.duration_s),
           responses, "Direct estimates with noise of 0.1 rad/s, seed 1.");
}

void add_amplitudes(report::Section& section, std::size_t seeds) {
  report::ComparisonTable table;
  table.title = "Amplitude of the sweep varied: T = 17 s, lambda = 8";
  const double lambda[] = {8.0};
  const auto grid = band_grid_hz();
  std::vector<Named> responses{{"true", true_response(with_amplitude(1.0), grid), Mark::line}};
  for (const double amplitude : kAmplitudes) {
    const auto experiment = with_amplitude(amplitude);
    const auto name = fmt::format("A = {:g} Nm", amplitude);
    add_rows(table, name, cases(experiment, lambda, seeds)[0]);
    const TrackedSweep tracked(run(experiment, 1), known(experiment), lambda[0]);
    responses.push_back({name, tracked.response(grid, Approach::direct), Mark::dashed});
  }
  section.tables.push_back(std::move(table));
  add_bode(section, "Counterpart of figure 4: system A, amplitude varied", responses,
           "Direct estimates with noise of 0.1 rad/s, seed 1; T = 17 s, lambda = 8.");
}

}  // namespace

Part figure_4(const Options& options) {
  Part part;
  auto& section = part.section;
  section.title = "Figure 4: lambda, duration and amplitude varied";
  section.text = {
      "System A, direct estimate. A larger lambda is quieter and slower; a slower sweep helps against both "
      "errors; the amplitude helps against noise alone."};
  auto deterministic =
      error_chart("Figure 4 in numbers: error without noise", "largest phase error above 5 Hz (deg)");
  auto random = error_chart("Figure 4 in numbers: error with noise", "rms relative error above 5 Hz");
  random.caption = fmt::format("Means over {} seeds.", options.seeds);
  for (const char* sweep : kSweeps) {
    const auto experiment = io::shipped_experiment(sweep);
    const double duration = experiment.excitation.duration_s;
    const auto all = cases(experiment, kLambdas, options.seeds);
    report::ComparisonTable table;
    table.title = fmt::format("T = {:g} s", duration);
    report::Curve clean, noisy;
    clean.name = noisy.name = fmt::format("T = {:g} s", duration);
    for (std::size_t i = 0; i < all.size(); ++i) {
      add_rows(table, fmt::format("lambda {:g}", kLambdas[i]), all[i]);
      clean.x.push_back(kLambdas[i]);
      clean.y.push_back(all[i].clean.degree_above_5hz);
      noisy.x.push_back(kLambdas[i]);
      noisy.y.push_back(spread(all[i].noisy_rms).mean);
    }
    deterministic.curves.push_back(std::move(clean));
    random.curves.push_back(std::move(noisy));
    section.tables.push_back(std::move(table));
    add_response_charts(section, experiment);
  }
  section.charts.push_back(std::move(deterministic));
  section.charts.push_back(std::move(random));
  add_amplitudes(section, options.seeds);
  return part;
}

}  // namespace resonid::reproduction::vi
