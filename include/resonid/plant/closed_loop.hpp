// SPDX-License-Identifier: MIT
#pragma once

#include <memory>
#include <resonid/base/expected.hpp>
#include <resonid/plant/detail/controller.hpp>
#include <resonid/plant/detail/drive.hpp>
#include <resonid/plant/detail/measurement.hpp>
#include <resonid/plant/detail/motion.hpp>

namespace resonid::plant {

/// The way of the torque from the controller to the motor.
struct ActuatorConfig {
  double lag_s = 0.0;
  double torque_resolution = 0.0;
};
template <class Visitor>
void describe(Visitor&& v, ActuatorConfig& c) {
  v("lag_s", c.lag_s, "time constant of the torque loop, first order; 0: none (s)");
  v("torque_resolution", c.torque_resolution, "step that the torque command is rounded to; 0: none (Nm)");
}

[[nodiscard]] expected<void, Error> check(const ActuatorConfig& config) noexcept;

/// A drive under its controller with delayed feedback, or alone.
///
///   y(k) = velocity((k - m - e) Ts) + n(k)          first, from torques up to u(k-1); filtered, held
///   u(k) = round(limit(C(r, y, position) + f + ru(k)))  then; it acts from k Ts to (k+1) Ts, with the torque
///                                                   f that a cascade feeds forward
///
/// It starts in the steady state of the motion's first sample: the machine turns or rests, the delay line is
/// full, the controller's integrator holds the torque that friction and load take. Without an integrator the
/// velocity settles where the controller's gain at 0 Hz leaves it, a machine held by a spring to the ground
/// rests where both balance; without a controller the machine turns at the motion's velocity, and u = ru +
/// the holding torque. Source: docs/methods/simulation.md.
class ClosedLoop {
 public:
  struct Sample {
    double input;      ///< u
    double output;     ///< y
    double reference;  ///< r: velocity reference of the motion, as late as the controller compares with it
    double place;      ///< angle of the driven side, or position of the cart, without delay
    double second;     ///< the drive's second output, as late as y
  };
  /// Everything around the machine. `setpoint_scale` turns the motion's unit into that of the driven side
  /// (1/r of a tooth belt); `count` is the encoder's step at the driven side, 0: none.
  struct Surroundings {
    Controller controller;
    MotionProfile motion;
    SampleDelay delay;
    VelocitySource velocity = VelocitySource::sensor;
    double count = 0.0;
    double torque_resolution = 0.0;
    double setpoint_scale = 1.0;
    double sample_time_s = 0.0;
    double filter_pole = 0.0;  ///< As in VelocityPath.
    std::size_t hold = 1;
    data::SecondOutput second_output = data::SecondOutput::none;  ///< That of the drive.
  };

  /// `drive` must have been made with delay.fraction as its early_fraction.
  ClosedLoop(std::unique_ptr<Drive> drive, Surroundings surroundings);

  Sample step(double excitation, double noise) noexcept;

  [[nodiscard]] const Drive& drive() const noexcept { return *drive_; }

 private:
  [[nodiscard]] Setpoint setpoint(double late_s) const noexcept;
  [[nodiscard]] double rounded(double torque) const noexcept;
  [[nodiscard]] double steady_velocity(double reference, double place);
  [[nodiscard]] double steady_place(double place);

  std::unique_ptr<Drive> drive_;
  Surroundings around_;
  MotionSensor sensor_;
  VelocityFilter filter_;
  MotionSensor second_;  // its angle is whatever the drive's second output is
  bool open_;
  bool moves_;
  std::size_t sample_ = 0;       // before constant_, which is of this sample
  Setpoint constant_;            // compared with in the first sample; in all where it stays
  double holding_torque_ = 0.0;  // without a controller only
};

}  // namespace resonid::plant
