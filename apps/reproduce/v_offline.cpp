// SPDX-License-Identifier: MIT
#include "reproduce/v_offline.hpp"

#include <fmt/format.h>

#include <cmath>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/response/welch.hpp>

#include "reproduce/runs.hpp"
#include "reproduce/spread.hpp"
#include "reproduce/vi_offline.hpp"

namespace resonid::reproduction::v {
namespace {

using Mark = report::Curve::Mark;

constexpr double kLow_hz = 20.0, kHigh_hz = 120.0;  // of the publication's lines
constexpr double kNoise = 0.1;                      // rad/s, as in the other tables over seeds
constexpr double kDuration_s = 20.0;                // of the chirps at rest

struct Place {
  const char* experiment;
  const char* name;
};
constexpr Place kPlaces[] = {
    {"v_tooth_chirp_near", "near end"}, {"v_tooth_chirp_middle", "middle"}, {"v_tooth_chirp_far", "far end"}};

/// The resting cart of a chirp experiment under a PRBS of the same amplitude.
plant::ExperimentConfig under_prbs(const Place& place, int cells, std::uint64_t seed) {
  auto c = io::shipped_experiment(place.experiment);
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = cells;
  c.measurement.noise_rms = kNoise;
  c.run.duration_s = kDuration_s;
  c.run.seed = seed;
  return c;
}

/// The long PRBS does not repeat within the record; the short one does 315 times, and its periods are the
/// segments.
data::FrequencyResponse spectra(const plant::ExperimentConfig& c, const data::Record& record) {
  response::WelchConfig config;
  config.band_low_hz = kLow_hz;
  config.band_high_hz = kHigh_hz;
  if (c.excitation.register_length <= 10)
    config.period_samples = (std::size_t{1} << c.excitation.register_length) - 1;
  else
    config.segment_samples = 4096;
  response::ResponseOptions options;
  options.approach = Approach::joint;
  options.delay_s = c.measurement.delay_s;
  return response::welch(record, config, options).value();
}

struct Found {
  std::vector<double> rms, sampled, continuous;
};

report::ComparisonTable table_of(const Place& place, std::size_t seeds, report::Chart* chart) {
  Found found;
  double truth_hz = 0.0;
  std::size_t lines = 0, short_lines = 0;
  for (std::size_t seed = 1; seed <= seeds; ++seed) {
    const auto c = under_prbs(place, 17, seed);
    const auto run = simulated(c);
    const auto g = spectra(c, run.record);
    const auto truth = simulated(c, g.frequency_hz).truth;
    truth_hz = truth.resonances.front().frequency_hz;
    double sum = 0.0;
    for (std::size_t i = 0; i < g.lines(); ++i) sum += std::norm(g.value[i] / truth.response.value[i] - 1.0);
    found.rms.push_back(100.0 * std::sqrt(sum / static_cast<double>(g.lines())));
    const double step = 1.0 / c.run.sample_rate_hz;
    const auto fitted = [&](vi::ModelKind kind) {
      return data::resonance_hz(vi::fitted_two_mass(g, step, *truth.two_mass, kind, kLow_hz, kHigh_hz));
    };
    found.sampled.push_back(100.0 * (fitted(vi::ModelKind::sampled) / truth_hz - 1.0));
    found.continuous.push_back(100.0 * (fitted(vi::ModelKind::continuous) / truth_hz - 1.0));
    if (seed > 1) continue;
    lines = g.lines();
    const auto few = under_prbs(place, 7, seed);
    const auto short_g = spectra(few, simulated(few).record);
    short_lines = short_g.lines();
    if (chart == nullptr) continue;
    const auto decibel = [](const std::vector<std::complex<double>>& values) {
      std::vector<double> db;
      for (const auto& v : values) db.push_back(20.0 * std::log10(std::abs(v)));
      return db;
    };
    chart->curves = {{"true", Mark::line, g.frequency_hz, decibel(truth.response.value)},
                     {"17 cells, 20 s", Mark::dashed, g.frequency_hz, decibel(g.value)},
                     {"7 cells, 20 s", Mark::points, short_g.frequency_hz, decibel(short_g.value)}};
  }
  report::ComparisonTable table{fmt::format("Cart at the {}, {:.1f} Hz", place.name, truth_hz), {}};
  table.rows = {
      row("lines, 17 cells", "", static_cast<double>(lines)),
      row("lines, 7 cells", "", static_cast<double>(short_lines), {}, {}, "15.7 Hz apart at 0.5 ms"),
      row("rms error of the lines, 17 cells", "%", spread(found.rms)),
      row("error of the resonance, eq. (28), sampled model", "%", spread(found.sampled), 0.0),
      row("error of the resonance, eq. (28), continuous model as printed", "%", spread(found.continuous),
          0.0)};
  return table;
}

}  // namespace

report::Section offline(std::size_t seeds) {
  report::Section section;
  section.title = "Off line at rest: averaged spectra, the source's benchmark";
  section.text = {
      "Publication V holds its sliding DFTs against Welch's method. Here the cart rests at three places, a "
      "PRBS "
      "of 1 Nm excites for 20 s in noise of 0.1 rad/s, Hann segments of 4096 samples overlap by half, and "
      "[J1, J2, K, D] of eq. (28) of Publication VI are fitted by Levenberg and Marquardt to the lines from "
      "20 "
      "to 120 Hz, begun at the machine itself.",
      "A PRBS of 7 cells repeats every 63.5 ms at this sample time: its lines lie 15.7 Hz apart and miss the "
      "resonance, whatever the averaging."};
  report::Chart chart;
  chart.title = "Averaged spectra, cart in the middle";
  chart.x_label = "frequency (Hz)";
  chart.y_label = "magnitude (dB)";
  chart.caption = "Seed 1.";
  for (const auto& place : kPlaces)
    section.tables.push_back(
        table_of(place, seeds, std::string_view(place.name) == "middle" ? &chart : nullptr));
  section.charts = {std::move(chart)};
  return section;
}

}  // namespace resonid::reproduction::v
