// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <resonid/plant/closed_loop.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <stdexcept>
#include <utility>

namespace resonid::test {

/// The published belt drive (resonance 15.1 Hz) in its velocity loop at 500 Hz, one sample at a time as a
/// host sees it: measure(), then apply() what may be injected. Keeps the largest values that the machine
/// itself has seen, without noise and delay.
class LiveMachine {
 public:
  static constexpr double kRate = 500.0;
  static constexpr double kGain = 1.036;

  struct Sample {
    double torque, velocity, position;
  };
  struct Reached {
    double torque = 0.0, velocity = 0.0;
    double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  };

  explicit LiveMachine(double gain = kGain, double noise_rms = 0.05)
      : controller_(make_controller(gain)),
        sensor_({2, 0.0}, plant::VelocitySource::sensor, 0.0, 1.0 / kRate),
        noise_(7, noise_rms) {
    plant::MachineConfig machine;
    machine.drive.driven_inertia = machine.drive.load_inertia = 0.032;
    machine.drive.stiffness = 5.75e4;
    machine.drive.damping = 100.0;
    machine.drive.radius_m = 0.05;
    auto drive = plant::make_drive(machine, kRate, 0.0);
    if (!drive) throw std::runtime_error("drive");
    drive_ = std::move(*drive);
    drive_->settle(0.0, 0.0);
    sensor_.settle(drive_->motions().front());
  }

  /// What the controller does now, from what is measured; a sensor that is stuck shows its last value.
  Sample measure(double reference) {
    const plant::MassMotion now = sensor_.read();
    if (!stuck_) measured_ = {now.angle, now.velocity + noise_.step()};
    command_ = coasts_ ? 0.0 : controller_.command({0.0, reference, 0.0}, measured_);
    const double velocity = stuck_ ? std::numeric_limits<double>::quiet_NaN() : measured_.velocity;
    return {command_, velocity, measured_.position};
  }
  void apply(double excitation) {
    if (!coasts_) controller_.commit(command_);
    const double torque = command_ + excitation;
    sensor_.push(drive_->advance(torque));
    const plant::MassMotion driven = drive_->motions().front();
    reached_.torque = std::max(reached_.torque, std::abs(torque));
    reached_.velocity = std::max(reached_.velocity, std::abs(driven.velocity));
    reached_.lowest = std::min(reached_.lowest, driven.angle);
    reached_.highest = std::max(reached_.highest, driven.angle);
  }

  void set_gain(double gain) { controller_ = make_controller(gain); }
  void stick_sensor() { stuck_ = true; }
  void coast() { coasts_ = true; }
  [[nodiscard]] const Reached& reached() const { return reached_; }
  [[nodiscard]] double velocity() const { return drive_->motions().front().velocity; }

 private:
  static plant::Controller make_controller(double gain) {
    plant::ControllerConfig c;
    c.kind = plant::ControllerKind::pi;
    c.gain = gain;
    c.integral_time_s = 0.147;
    auto controller = plant::Controller::create(c, kRate);
    if (!controller) throw std::runtime_error("controller");
    return *controller;
  }

  plant::Controller controller_;
  plant::MotionSensor sensor_;
  plant::WhiteNoise noise_;
  std::unique_ptr<plant::Drive> drive_;
  plant::Measured measured_{};
  double command_ = 0.0;
  bool stuck_ = false, coasts_ = false;
  Reached reached_{};
};

}  // namespace resonid::test
