// SPDX-License-Identifier: MIT
// Sample by sample, as in a drive's firmware: the plant's response at eight lines while the loop is closed,
// without knowing the controller. The lines come from a multisine that is added to the controller's output.
#include <array>
#include <cstdlib>
#include <iostream>
#include <resonid/online/lines/kalman_bank.hpp>
#include <resonid/online/lines/response_tracker.hpp>
#include <resonid/plant/experiment.hpp>

namespace plant = resonid::plant;
namespace online = resonid::online;

plant::ExperimentConfig published_experiment(std::span<const double> lines_hz) {
  plant::ExperimentConfig experiment;
  experiment.drive.driven_inertia = 0.032;
  experiment.drive.load_inertia = 0.032;
  experiment.drive.stiffness = 5.75e4;
  experiment.drive.damping = 100.0;
  experiment.drive.radius_m = 0.05;
  experiment.controller.kind = plant::ControllerKind::pi;
  experiment.controller.gain = 1.036;
  experiment.controller.integral_time_s = 0.147;
  experiment.excitation.kind = resonid::online::Kind::multisine;
  experiment.excitation.lines_hz.assign(lines_hz);
  experiment.measurement.delay_s = 0.004;
  experiment.measurement.noise_rms = 0.1;
  experiment.run.sample_rate_hz = 500.0;
  experiment.run.duration_s = 15.0;
  return experiment;
}

int main() {
  const std::array lines_hz{2.9, 5.9, 8.9, 11.9, 14.9, 17.9, 20.9, 23.9};
  const auto simulation = plant::simulate_closed_loop(published_experiment(lines_hz), lines_hz);
  if (!simulation) return EXIT_FAILURE;
  const resonid::data::Record& record = simulation->record;

  online::KalmanBankConfig config;
  config.sample_rate_hz = record.sample_rate_hz;
  config.frequency_hz = lines_hz;
  config.lambda = 400.0;  // larger is quieter and slower
  const auto bank = online::KalmanBank<double, 8>::create(config);
  if (!bank) return EXIT_FAILURE;
  online::ResponseTrackerConfig response;
  response.known_delay_s = 0.004;
  auto tracker = online::ResponseTracker<online::KalmanBank<double, 8>>::create(*bank, response);
  if (!tracker) return EXIT_FAILURE;

  // This loop is what runs in the drive: excitation, torque and velocity of the newest sample.
  for (std::size_t k = 0; k < record.samples(); ++k)
    tracker->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);

  bool right = tracker->ready();
  for (std::size_t i = 0; i < tracker->lines(); ++i) {
    const auto g = tracker->response(i, resonid::Approach::joint);
    const double error = std::abs(g - simulation->truth.response.value[i]);
    std::cout << lines_hz[i] << " Hz: |G| = " << std::abs(g) << " +- " << tracker->standard_deviation(i)
              << ", off by " << error << "\n";
    right = right && error < 4.0 * tracker->standard_deviation(i);
  }
  return right ? EXIT_SUCCESS : EXIT_FAILURE;
}
