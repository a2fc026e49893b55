// SPDX-License-Identifier: MIT
// A drive in closed loop instead of a test bench: the published belt drive under its PI controller, measured
// with noise and a delay of two samples, while a chirp is added to the controller's output.
#include <cstdlib>
#include <iostream>
#include <resonid/base/error_text.hpp>
#include <resonid/plant/experiment.hpp>

namespace plant = resonid::plant;

int main() {
  plant::ExperimentConfig experiment;
  experiment.drive.driven_inertia = 0.032;
  experiment.drive.load_inertia = 0.032;
  experiment.drive.stiffness = 5.75e4;  // of the belt, N/m, because a radius is given
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
  experiment.run.seed = 1;  // the same seed gives the same samples, everywhere

  const auto simulation = plant::simulate_closed_loop(experiment);
  if (!simulation) {
    std::cerr << resonid::message_of(simulation.error()) << "\n";
    return EXIT_FAILURE;
  }

  const resonid::data::Record& record = simulation->record;
  const double true_resonance_hz = resonid::data::resonance_hz(*simulation->truth.two_mass);
  std::cout << record.samples() << " samples at " << record.sample_rate_hz << " Hz; the true resonance is at "
            << true_resonance_hz << " Hz\n";
  const bool as_published = record.samples() == 8500 && true_resonance_hz > 15.0 && true_resonance_hz < 15.2;
  return as_published ? EXIT_SUCCESS : EXIT_FAILURE;
}
