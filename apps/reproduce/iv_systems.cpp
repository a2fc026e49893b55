// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cassert>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/gap.hpp>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/response/detail/tracked_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>
#include <resonid/response/welch.hpp>

#include "reproduce/publication_iv.hpp"
#include "reproduce/runs.hpp"

namespace resonid::reproduction::iv {
namespace {

using Bank = online::KalmanBank<double, kLines>;
constexpr double kSettled = 2.0;  // seconds until the run-up to speed is over

/// The published estimate: banks on u and y, direct, read after the last sample.
Response newest_response(const data::Record& record, const std::vector<double>& lines_hz, double delay_s) {
  online::KalmanBankConfig config;
  config.sample_rate_hz = record.sample_rate_hz;
  config.frequency_hz = lines_hz;
  config.lambda = kLambda;
  const auto bank = Bank::create(config);
  assert(bank);
  online::ResponseTrackerConfig response;
  response.known_delay_s = delay_s;
  auto tracker = online::ResponseTracker<Bank>::create(*bank, response);
  assert(tracker);
  for (std::size_t k = 0; k < record.samples(); ++k)
    tracker->step(record.input.samples[k], record.output.samples[k]);
  Response out;
  for (std::size_t i = 0; i < lines_hz.size(); ++i) out.push_back(tracker->response(i, Approach::direct));
  return out;
}

/// The same lines over the last two whole periods of 10 s (kJudged).
Response whole_periods(const data::Record& record, const std::vector<double>& lines_hz, double delay_s,
                       response::LineMethod method) {
  response::TrackedLinesConfig config;
  config.lines_hz = lines_hz;
  config.method = method;
  config.lambda = kLambda;
  config.period_samples = static_cast<std::size_t>(std::lround(10.0 * record.sample_rate_hz));
  config.first_sample = method == response::LineMethod::least_squares ? config.period_samples : 0;
  response::ResponseOptions options;
  options.approach = Approach::direct;
  options.delay_s = delay_s;
  const auto response = response::tracked_lines(record, config, options);
  assert(response && response->lines() == lines_hz.size());
  return response->value;
}

/// |U| at the lines, over whole periods at the end of a record without noise.
std::vector<double> input_amplitudes(const data::Record& clean, const std::vector<double>& lines_hz) {
  const auto samples = static_cast<std::ptrdiff_t>(std::lround(kJudged * clean.sample_rate_hz));
  const auto& u = clean.input.samples;
  auto out = spectrum({u.end() - samples, u.end()}, clean.sample_rate_hz, lines_hz);
  for (double& amplitude : out) amplitude *= 2.0 * clean.sample_rate_hz / static_cast<double>(samples);
  return out;
}

}  // namespace

plant::Simulation simulate(const plant::ExperimentConfig& config, double noise_rms, std::uint64_t seed) {
  auto experiment = config;
  experiment.measurement.noise_rms = noise_rms;
  experiment.run.seed = seed;
  return simulated(experiment);
}

System run_system(std::string name, const plant::ExperimentConfig& config, const Options& options,
                  const Step& step) {
  System s;
  s.name = std::move(name);
  s.noise_rms = config.measurement.noise_rms;
  const auto lines = config.excitation.lines_hz.hz();
  s.lines_hz.assign(lines.begin(), lines.end());
  const auto clean = simulate(config, 0.0, 1);
  s.truth = clean.truth;
  s.true_response = true_response(s.truth, s.lines_hz);
  s.input_amplitude = input_amplitudes(clean.record, s.lines_hz);
  s.noise_free = newest_response(clean.record, s.lines_hz, s.truth.delay_s);
  for (std::size_t seed = 1; seed <= options.seeds; ++seed) {
    const auto record = simulate(config, s.noise_rms, seed).record;
    s.newest.push_back(newest_response(record, s.lines_hz, s.truth.delay_s));
    s.averaged.push_back(whole_periods(record, s.lines_hz, s.truth.delay_s, response::LineMethod::kalman));
    s.least_squares.push_back(
        whole_periods(record, s.lines_hz, s.truth.delay_s, response::LineMethod::least_squares));
    step(static_cast<double>(seed) / static_cast<double>(options.seeds));
  }
  return s;
}

OfflineRun run_offline(const plant::ExperimentConfig& config, const Options& options, const Step& step) {
  OfflineRun run;
  const auto bits = (std::size_t{1} << config.excitation.register_length) - 1;
  const auto settled = static_cast<std::size_t>(kSettled * config.run.sample_rate_hz);
  response::PeriodicConfig periodic;
  periodic.period_samples = bits * config.excitation.clock_divider;
  periodic.drop_periods = 1 + settled / periodic.period_samples;
  response::WelchConfig welch;
  welch.segment_samples = kSegment;
  periodic.band_low_hz = welch.band_low_hz = 2.0;
  periodic.band_high_hz = welch.band_high_hz = 30.0;
  run.period_s = static_cast<double>(periodic.period_samples) / config.run.sample_rate_hz;
  for (std::size_t seed = 1; seed <= options.seeds; ++seed) {
    const auto simulation = simulate(config, config.measurement.noise_rms, seed);
    const auto& record = simulation.record;
    response::ResponseOptions response;
    response.delay_s = simulation.truth.delay_s;
    const bool repeats = (periodic.drop_periods + 2) * periodic.period_samples <= record.samples();
    if (repeats) run.averaged.push_back(response::periodic_average(record, periodic, response).value());
    const auto rest = data::part_of(record, settled, record.samples() - settled);
    run.welch.push_back(response::welch(rest, welch, response).value());
    run.truth = simulation.truth;
    step(static_cast<double>(seed) / static_cast<double>(options.seeds));
  }
  return run;
}

Response true_response(const plant::Truth& truth, const std::vector<double>& frequency_hz) {
  Response out;
  for (const double f : frequency_hz) out.push_back(truth.plant.response(f));
  return out;
}

Response open_loop(const Response& plant, const std::vector<double>& frequency_hz,
                   const plant::Truth& truth) {
  Response out;
  for (std::size_t i = 0; i < plant.size(); ++i)
    out.push_back(truth.controller->response(frequency_hz[i]) * plant[i] *
                  std::polar(1.0, -kTwoPi * frequency_hz[i] * truth.delay_s));
  return out;
}

Response complementary_sensitivity(const Response& plant, const std::vector<double>& frequency_hz,
                                   const plant::Truth& truth) {
  Response out = open_loop(plant, frequency_hz, truth);
  for (auto& loop : out) loop /= 1.0 + loop;
  return out;
}

std::vector<double> distance(const Response& first, const Response& second) {
  std::vector<double> out;
  for (std::size_t i = 0; i < first.size(); ++i)
    out.push_back(diagnostics::chordal_distance(first[i], second[i]));
  return out;
}

std::vector<double> even_ratio_grid_hz(double low_hz, double high_hz, int points) {
  std::vector<double> grid;
  for (int i = 0; i < points; ++i) grid.push_back(low_hz * std::pow(high_hz / low_hz, i / (points - 1.0)));
  return grid;
}

std::vector<double> magnitude_db(const Response& response) {
  std::vector<double> out;
  for (const auto& g : response) out.push_back(20.0 * std::log10(std::abs(g)));
  return out;
}

std::vector<double> phase_deg(const Response& response) {
  std::vector<double> out;
  for (const auto& g : response) {
    double phase = std::arg(g) * 180.0 / kPi;
    if (!out.empty()) phase -= 360.0 * std::round((phase - out.back()) / 360.0);
    out.push_back(phase);
  }
  return out;
}

}  // namespace resonid::reproduction::iv
