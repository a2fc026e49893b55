// SPDX-License-Identifier: MIT
#include "reproduce/vi_experiment.hpp"

#include <cmath>
#include <resonid/base/constants.hpp>

namespace resonid::reproduction::vi {
namespace {

/// Everything but the record, at the price of a few samples.
plant::Truth truth(plant::ExperimentConfig experiment, std::span<const double> grid) {
  experiment.run.duration_s = 10.0 / experiment.run.sample_rate_hz;
  return simulated(experiment, grid).truth;
}

}  // namespace

Known known(const plant::ExperimentConfig& experiment) {
  const auto& e = experiment.excitation;
  Known k;
  k.sweep = {e.from_hz, e.to_hz, e.duration_s, online::Sweep::linear};
  const double one_hz[] = {1.0};
  k.controller = truth(experiment, one_hz).controller;
  k.delay_s = experiment.measurement.delay_s;
  return k;
}

data::Record run(const plant::ExperimentConfig& experiment, std::uint64_t seed) {
  auto config = experiment;
  config.run.seed = seed;
  auto record = simulated(config).record;
  for (std::size_t k = 0; k < record.reference.samples.size(); ++k)
    record.output.samples[k] -= record.reference.samples[k];
  record.reference.samples.clear();
  return record;
}

data::Record run_without_noise(plant::ExperimentConfig experiment) {
  experiment.measurement.noise_rms = 0.0;
  return run(experiment, 1);
}

data::FrequencyResponse true_response(plant::ExperimentConfig experiment,
                                      std::span<const double> frequencies_hz) {
  return truth(std::move(experiment), frequencies_hz).response;
}

data::FrequencyResponse true_loop(const plant::ExperimentConfig& experiment,
                                  std::span<const double> frequencies_hz, bool delay) {
  const Known k = known(experiment);
  auto loop = published_loop(true_response(experiment, frequencies_hz), k);
  for (std::size_t i = 0; delay && i < loop.lines(); ++i)
    loop.value[i] *= std::polar(1.0, -kTwoPi * loop.frequency_hz[i] * k.delay_s);
  return loop;
}

data::TwoMassParameters true_parameters(const plant::ExperimentConfig& experiment) {
  return plant::at_driven_shaft(experiment.drive);
}

data::FrequencyResponse published_loop(data::FrequencyResponse response, const Known& known) {
  for (std::size_t i = 0; i < response.lines(); ++i)
    response.value[i] *= known.controller->response(response.frequency_hz[i]);
  response.std.clear();
  response.coherence.clear();
  return response;
}

std::vector<double> band_grid_hz() { return grid_hz(2.0, 33.0, 0.1); }

}  // namespace resonid::reproduction::vi
