// SPDX-License-Identifier: MIT
// A result in; a controller that keeps its bounds for every machine in the error bars, as text, out.
#include <cstdlib>
#include <iostream>
#include <resonid/resonid.hpp>

/// The published drive, excited under a PI controller by a sweep.
resonid::SimulateOptions published_experiment() {
  resonid::SimulateOptions experiment;
  experiment.drive.driven_inertia = experiment.drive.load_inertia = 0.032;
  experiment.drive.stiffness = 5.75e4;
  experiment.drive.damping = 120.0;
  experiment.drive.radius_m = 0.05;
  experiment.controller.kind = resonid::plant::ControllerKind::pi;
  experiment.controller.gain = 1.036;
  experiment.controller.integral_time_s = 0.147;
  experiment.excitation.kind = resonid::online::Kind::chirp;
  experiment.excitation.from_hz = 35.0;
  experiment.excitation.to_hz = 1.5;
  experiment.excitation.duration_s = 17.0;
  experiment.measurement.delay_s = 0.004;
  experiment.measurement.noise_rms = 0.1;
  experiment.run.sample_rate_hz = 500.0;
  experiment.motion = {resonid::plant::MotionKind::constant, 10.0};
  return experiment;
}

int main() {
  const auto record = resonid::simulate(published_experiment()).value().record;
  const auto result =
      resonid::identify(record, {.controller = resonid::pi(1.036, 0.147), .delay_s = 0.004}).value();

  resonid::TuneOptions wanted;
  wanted.structure = resonid::identification::ControllerStructure::pi;
  wanted.largest_sensitivity = 1.6;
  wanted.draws = 2000;
  auto design = resonid::tune(result, wanted);
  if (!design) {
    std::cerr << design.error().field << ": " << design.error().requirement << "\n";
    return EXIT_FAILURE;
  }
  for (const auto& figure : design->proposed().figures)
    if (figure.bound)
      std::cout << figure.name << " " << figure.value << ", at most " << *figure.bound << "\n";
  resonid::simulate_on_model(*design, result);  // beside what is promised, on the page too
  resonid::write_report("tune.html", *design).value();
  std::cout << resonid::exported(*design, resonid::ExportFormat::structured_text).value();

  // The machine again, under the new controller: is the loop as promised?
  const auto law =
      resonid::read_controller(resonid::controller_json(*design).value(), design->sample_time_s).value();
  auto experiment = published_experiment();
  experiment.controller = {};
  experiment.controller.kind = resonid::plant::ControllerKind::transfer_function;
  experiment.controller.numerator = law.numerator;
  experiment.controller.denominator = law.denominator;
  experiment.run.seed = 2;
  const auto after = resonid::simulate(experiment).value().record;
  const auto measured = resonid::identify(after, {.controller = law, .delay_s = 0.004}).value();
  if (!resonid::check_on(*design, result, measured)) return EXIT_FAILURE;
  std::cout << (design->check->agrees ? "as promised" : design->check->cause) << "\n";
  return design->trusted && design->check->agrees ? EXIT_SUCCESS : EXIT_FAILURE;
}
