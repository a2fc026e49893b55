// SPDX-License-Identifier: MIT
// The whole path: record in; frequency response, resonance, physical parameters, margins and trust out. The
// record is simulated here; resonid::io reads one from a CSV or MAT file.
#include <cmath>
#include <cstdlib>
#include <iostream>
#include <resonid/data/transfer_function.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/plant/experiment.hpp>

namespace plant = resonid::plant;
namespace identification = resonid::identification;

plant::ExperimentConfig published_experiment() {
  plant::ExperimentConfig experiment;
  experiment.drive.driven_inertia = 0.032;
  experiment.drive.load_inertia = 0.032;
  experiment.drive.stiffness = 5.75e4;
  experiment.drive.damping = 120.0;
  experiment.drive.radius_m = 0.05;
  experiment.controller.kind = plant::ControllerKind::pi;
  experiment.controller.gain = 1.036;
  experiment.controller.integral_time_s = 0.147;
  experiment.excitation.kind = resonid::online::Kind::chirp;
  experiment.excitation.from_hz = 35.0;
  experiment.excitation.to_hz = 1.5;
  experiment.excitation.duration_s = 17.0;
  experiment.measurement.delay_s = 0.004;
  experiment.measurement.noise_rms = 0.1;
  experiment.run.sample_rate_hz = 500.0;
  experiment.motion = {plant::MotionKind::constant, 10.0};
  return experiment;
}

int main() {
  const auto simulation = plant::simulate_closed_loop(published_experiment());
  if (!simulation) return EXIT_FAILURE;
  const resonid::data::Record& record = simulation->record;

  identification::Options options;
  options.excitation_type = identification::ExcitationType::chirp;
  options.chirp = {35.0, 1.5, 17.0};
  options.controller = resonid::data::pi_controller(1.036, 0.147, record.sample_time_s());
  options.delay_s = 0.004;

  const auto result = identification::identify(record, options);
  if (!result) {
    std::cerr << result.error().field << ": " << result.error().requirement << "\n";
    return EXIT_FAILURE;
  }

  for (const auto& found : result->modes)
    std::cout << found.name() << " " << found.frequency_hz.value << " Hz +- " << found.frequency_hz.std
              << "\n";
  for (const auto& finding : result->findings) std::cout << finding.meaning << "\n";

  const double true_hz = resonid::data::resonance_hz(*simulation->truth.two_mass);
  const bool right = result->trusted && result->modes.size() == 2 &&
                     std::abs(result->modes.back().frequency_hz.value - true_hz) < 0.05;
  return right ? EXIT_SUCCESS : EXIT_FAILURE;
}
