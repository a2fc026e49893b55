// SPDX-License-Identifier: MIT
// The first injection into a live machine: the excitation ramps in, and what it might do wrong is watched.
// Then the same machine with a controller gain that is too high: the guard stops the injection, says why, and
// the host falls back to the gain that works.
#include <cstdlib>
#include <iostream>
#include <resonid/online/excitation/guarded_excitation.hpp>
#include <resonid/online/excitation/prbs.hpp>
#include <resonid/plant/closed_loop.hpp>

namespace online = resonid::online;
namespace plant = resonid::plant;

constexpr double kRateHz = 1000.0;
constexpr double kWorkingGain = 1.0;

plant::Controller controller(double gain) {
  plant::ControllerConfig config;
  config.kind = plant::ControllerKind::pi;
  config.gain = gain;
  config.integral_time_s = 0.15;
  return plant::Controller::create(config, kRateHz).value();
}

/// Runs the machine for ten seconds at this gain; returns what stopped the injection.
online::StopReport<double> run(double gain, double& largest_velocity) {
  plant::MachineConfig machine;
  machine.drive.driven_inertia = 0.032;
  machine.drive.load_inertia = 0.032;
  machine.drive.stiffness = 143.75;
  machine.drive.damping = 0.25;
  const auto drive = plant::make_drive(machine, kRateHz, 0.0).value();
  drive->settle(0.0, 0.0);
  plant::MotionSensor sensor({3, 0.0}, plant::VelocitySource::sensor, 0.0, 1.0 / kRateHz);  // 3 ms late
  sensor.settle(drive->motions().front());
  auto law = controller(gain);

  auto prbs = online::Prbs::create({.sample_rate_hz = kRateHz, .amplitude = 2.0}).value();
  online::GuardedExcitationConfig config;
  config.sample_rate_hz = kRateHz;
  config.amplitude = 2.0;
  config.duration_s = 9.0;
  config.torque_limit = 40.0;  // the machine's own limits; the guard stops at 0.9 of them
  config.velocity_limit = 20.0;
  config.position_low = -10.0;
  config.position_high = 10.0;
  config.deceleration = 50.0;
  config.reaction_s = 0.003;
  config.oscillation_from_hz = 5.0;
  config.oscillation_window_s = 0.1;
  config.oscillation_least = 0.2;
  config.oscillation_expected = 0.3;
  auto guard = online::GuardedExcitation<double>::create(config).value();

  bool fell_back = false;
  largest_velocity = 0.0;
  for (int k = 0; k < 10000; ++k) {  // what follows is what a servo thread does
    const auto measured = sensor.read();
    const double command = law.command({}, {measured.angle, measured.velocity});
    const double x = guard.step(prbs.step(), {command, measured.velocity, measured.angle});
    law.commit(command);
    sensor.push(drive->advance(command + x));
    largest_velocity = std::max(largest_velocity, std::abs(measured.velocity));
    if (guard.tripped() && !fell_back) {
      law = controller(kWorkingGain);
      fell_back = true;
    }
  }
  return guard.report();
}

int main() {
  bool right = true;
  for (const double gain : {kWorkingGain, 14.5}) {
    double largest_velocity = 0.0;
    const auto report = run(gain, largest_velocity);
    std::cout << "gain " << gain << " Nms/rad: " << to_words(report.reason) << ", at "
              << static_cast<double>(report.sample) / kRateHz << " s (" << report.value << " against "
              << report.limit << "); largest velocity " << largest_velocity << " rad/s\n";
    right = right && largest_velocity < 20.0 &&
            report.reason ==
                (gain == kWorkingGain ? online::StopReason::finished : online::StopReason::oscillation);
  }
  return right ? EXIT_SUCCESS : EXIT_FAILURE;
}
