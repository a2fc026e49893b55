// SPDX-License-Identifier: MIT
// One axis of a machine while it runs, as in a drive's firmware: it is excited within limits, and sample by
// sample come resonance, anti-resonance and the margins of the loop with their standard deviations, without
// knowing the controller.
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <iostream>
#include <resonid/data/two_mass.hpp>
#include <resonid/online/axis.hpp>
#include <resonid/plant/closed_loop.hpp>

namespace online = resonid::online;
namespace plant = resonid::plant;

constexpr double kRateHz = 1000.0;

void print(const online::AxisRow& row) {
  std::cout << "resonance " << row.resonance_hz.value << " +- " << row.resonance_hz.std
            << " Hz, phase margin " << row.phase_margin_deg.value << " +- " << row.phase_margin_deg.std
            << " deg\n";
}

int main() {
  plant::MachineConfig machine;
  machine.drive.driven_inertia = 0.032;
  machine.drive.load_inertia = 0.032;
  machine.drive.stiffness = 143.75;
  machine.drive.damping = 0.25;
  const auto drive = plant::make_drive(machine, kRateHz, 0.0).value();
  drive->settle(0.0, 0.0);
  plant::MotionSensor sensor({3, 0.0}, plant::VelocitySource::sensor, 0.0, 1.0 / kRateHz);  // 3 ms late
  sensor.settle(drive->motions().front());
  plant::ControllerConfig pi;
  pi.kind = plant::ControllerKind::pi;
  pi.gain = 1.0;
  pi.integral_time_s = 0.15;
  auto controller = plant::Controller::create(pi, kRateHz).value();

  std::array<double, 24> lines_hz{};
  for (std::size_t i = 0; i < lines_hz.size(); ++i) lines_hz[i] = 1.0 + static_cast<double>(i);
  online::AxisConfig config;
  config.sample_rate_hz = kRateHz;
  config.known_delay_s = 0.003;
  config.lines_hz = lines_hz;
  config.loop = online::AxisLoop::measured;  // margins of whatever controller acts
  config.row_every_samples = 1000;
  config.injects = true;
  alignas(online::Axis) static std::byte memory[sizeof(online::Axis)];
  online::Axis* axis = online::Axis::create_in(memory, config).value();
  if (!axis->start({.guard = {.amplitude = 2.0, .torque_limit = 40.0, .velocity_limit = 20.0}}))
    return EXIT_FAILURE;

  for (int k = 0; k < 20000; ++k) {  // what follows is what a servo thread does
    const auto measured = sensor.read();
    double torque = controller.command({}, {measured.angle, measured.velocity});
    controller.commit(torque);
    torque += axis->excite({.torque = torque, .velocity = measured.velocity});
    if (axis->step({axis->injected(), torque, measured.velocity}) && axis->row().trusted) print(axis->row());
    sensor.push(drive->advance(torque));
  }
  const double true_hz = resonid::data::resonance_hz({0.032, 0.032, 143.75, 0.25});
  const bool right = std::abs(axis->row().resonance_hz.value - true_hz) < 0.001 * true_hz;
  return axis->row().trusted && right ? EXIT_SUCCESS : EXIT_FAILURE;
}
