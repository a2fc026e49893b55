// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/closed_loop.hpp>
#include <string>
#include <utility>
#include <vector>

namespace resonid::plant::test {

/// Coupled belt drive (Nevaranta 2016, eqs. 2.1-2.3), driven on the first roller.
inline DriveConfig coupled_belt(double driven, double load, double stiffness, double damping) {
  DriveConfig c;
  c.driven_inertia = driven;
  c.load_inertia = load;
  c.stiffness = stiffness;
  c.damping = damping;
  c.radius_m = 0.05;
  return c;
}
inline DriveConfig system_1() { return coupled_belt(0.032, 0.032, 3.10e4, 90.0); }
inline DriveConfig system_2() { return coupled_belt(0.032, 0.032, 5.75e4, 120.0); }
inline DriveConfig system_3(bool first_driven) {
  return first_driven ? coupled_belt(0.018, 0.032, 7.00e4, 100.0) : coupled_belt(0.032, 0.018, 7.00e4, 100.0);
}

/// System 2 with a tensioner through which half of the static stiffness goes, as the independent
/// implementation has it (tests/golden/README.md).
inline DriveConfig with_tensioner() {
  DriveConfig c;
  c.structure = Structure::three_mass;
  c.driven_inertia = 0.032;
  c.middle_inertia = 0.0012;
  c.load_inertia = 0.032;
  c.stiffness = c.stiffness_2 = 143.75;
  c.damping = c.damping_2 = 0.3 * 0.3;
  c.bypass_stiffness = 0.5 * 143.75;
  c.bypass_damping = 0.85 * 0.3;
  return c;
}

/// Tooth belt (Nevaranta 2016, section 2.2) with the geometry of the independent implementation.
inline DriveConfig tooth_belt(double radius_m = 0.0199) {
  DriveConfig c;
  c.structure = Structure::tooth_belt;
  c.driven_inertia = 0.0028;
  c.cart_mass_kg = 6.7;
  c.radius_m = radius_m;
  c.specific_stiffness_n = 376406.25;
  c.quality = 10.0;
  c.upper_length_m = 1.7;
  c.lower_length_m = 2.14;
  c.stroke_from_m = 0.1;
  c.stroke_to_m = 1.69;
  return c;
}

inline DriveConfig chain(std::size_t masses) {
  DriveConfig c;
  c.structure = Structure::chain;
  for (std::size_t i = 0; i < masses; ++i) {
    const auto x = static_cast<double>(i);
    c.inertias.push_back(0.03 / (1.0 + 0.4 * x));
    if (i + 1 == masses) break;
    c.stiffnesses.push_back(150.0 + 40.0 * x);
    c.dampings.push_back(0.25 + 0.05 * x);
  }
  return c;
}

inline DriveConfig rigid() {
  DriveConfig c;
  c.structure = Structure::rigid;
  c.driven_inertia = 0.05;
  c.viscous_friction = 0.07;
  return c;
}

inline ControllerConfig pi_controller(double gain, double integral_time_s) {
  ControllerConfig c;
  c.kind = ControllerKind::pi;
  c.gain = gain;
  c.integral_time_s = integral_time_s;
  return c;
}

/// A loop around a machine; `motion`, `velocity`, `count` as in ClosedLoop::Surroundings.
struct LoopConfig {
  MachineConfig machine;
  ControllerConfig controller;
  double sample_rate_hz = 500.0;
  double delay_s = 0.0;
  MotionConfig motion;
  VelocitySource velocity = VelocitySource::sensor;
  double count = 0.0;
  double torque_resolution = 0.0;
  double longest_s = 0.0;
  double filter_pole = 0.0;
  std::size_t hold = 1;
};

inline ClosedLoop make_loop(const LoopConfig& c) {
  const SampleDelay delay = split_delay(c.delay_s, c.sample_rate_hz);
  const bool belt = c.machine.drive.structure == Structure::tooth_belt;
  return ClosedLoop(
      make_drive(c.machine, c.sample_rate_hz, delay.fraction, c.longest_s).value(),
      {Controller::create(c.controller, c.sample_rate_hz).value(), MotionProfile::create(c.motion).value(),
       delay, c.velocity, c.count, c.torque_resolution, belt ? 1.0 / c.machine.drive.radius_m : 1.0,
       1.0 / c.sample_rate_hz, c.filter_pole, c.hold, c.machine.second_output});
}

}  // namespace resonid::plant::test
