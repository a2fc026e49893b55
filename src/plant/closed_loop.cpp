// SPDX-License-Identifier: MIT
#include <cmath>
#include <resonid/plant/closed_loop.hpp>
#include <utility>

namespace resonid::plant {

expected<void, Error> check(const ActuatorConfig& c) noexcept {
  if (!(c.lag_s >= 0.0)) return refuse("lag_s", "must be >= 0", c.lag_s);
  if (!(c.torque_resolution >= 0.0)) return refuse("torque_resolution", "must be >= 0", c.torque_resolution);
  return {};
}

ClosedLoop::ClosedLoop(std::unique_ptr<Drive> drive, Surroundings surroundings)
    : drive_(std::move(drive)),
      around_(std::move(surroundings)),
      sensor_(around_.delay, around_.velocity, around_.count, around_.sample_time_s),
      filter_({around_.velocity, around_.filter_pole, around_.hold, 0.0}),
      second_(around_.delay, VelocitySource::sensor, 0.0, around_.sample_time_s),
      open_(!around_.controller.closed()),
      moves_(around_.motion.moves() || around_.controller.uses_position()),
      constant_(setpoint(around_.controller.reference_delay_s())) {
  double place = around_.motion.at(0.0).position;
  const bool grounded = !open_ && drive_->grounded();
  if (grounded) place = steady_place(place);
  const double velocity = open_ || grounded ? constant_.velocity : steady_velocity(constant_.velocity, place);
  holding_torque_ = drive_->settle(velocity, place);
  const double late_s =
      (static_cast<double>(around_.delay.whole) + around_.delay.fraction) * around_.sample_time_s;
  if (around_.controller.uses_position()) {  // what is measured must lie behind the reference as it will
    const double measured = constant_.position - around_.controller.following_error(velocity);
    const double off = measured + velocity * late_s - drive_->motions().front().angle;
    holding_torque_ = drive_->settle(velocity, place + off / around_.setpoint_scale);
  }
  const MassMotion now = drive_->motions().front();
  sensor_.settle(now);
  filter_.settle(velocity);
  second_.settle(
      {around_.second_output == data::SecondOutput::load_encoder ? velocity : 0.0, drive_->second_output()});
  const double fed_forward = around_.controller.torque_feedforward({0.0, constant_.velocity, 0.0});
  around_.controller.settle(constant_, {now.angle - velocity * late_s, velocity},
                            holding_torque_ - fed_forward);
}

double ClosedLoop::steady_velocity(double reference, double place) {
  const Controller& controller = around_.controller;
  const auto imbalance = [&](double velocity) {
    return controller.imbalance(reference, velocity, drive_->settle(velocity, place));
  };
  if (imbalance(reference) == 0.0) return reference;
  const double at_rest = imbalance(0.0);
  if (at_rest == 0.0) return 0.0;
  // Secant on the side to which it starts; linear there but for the Stribeck effect.
  double velocity = std::copysign(reference != 0.0 ? std::abs(reference) : 1.0, at_rest);
  double other = 0.5 * velocity;
  double at_other = imbalance(other);
  for (int i = 0; i < 50 && velocity != other; ++i) {
    const double at_velocity = imbalance(velocity);
    if (at_velocity == at_other) break;
    const double next = velocity - at_velocity * (velocity - other) / (at_velocity - at_other);
    other = std::exchange(velocity, next);
    at_other = at_velocity;
    if (velocity * at_rest <= 0.0) return 0.0;  // friction holds it
    if (std::abs(velocity - other) <= 1e-14 * std::abs(velocity)) break;
  }
  return velocity;
}

/// Of a machine at rest that springs hold: where the controller gives what they take, which is linear.
double ClosedLoop::steady_place(double place) {
  const auto imbalance = [&](double at) {
    return around_.controller.imbalance(constant_.velocity, constant_.velocity, drive_->settle(0.0, at));
  };
  const double here = imbalance(place);
  const double slope = imbalance(place + 1.0) - here;
  return slope == 0.0 ? place : place - here / slope;  // 0: an integrator holds it anywhere
}

Setpoint ClosedLoop::setpoint(double late_s) const noexcept {
  Setpoint at = around_.motion.at(static_cast<double>(sample_) * around_.sample_time_s - late_s);
  at.position *= around_.setpoint_scale;
  at.velocity *= around_.setpoint_scale;
  at.acceleration *= around_.setpoint_scale;
  return at;
}

/// To a step of the torque command, the next one inside where the nearest lies beyond the limit.
double ClosedLoop::rounded(double torque) const noexcept {
  const double step = around_.torque_resolution;
  const double nearest = step * std::floor(torque / step + 0.5);
  return around_.controller.limit(nearest) == nearest ? nearest : nearest - std::copysign(step, nearest);
}

ClosedLoop::Sample ClosedLoop::step(double excitation, double noise) noexcept {
  const MassMotion measured = sensor_.read();
  const double velocity = filter_.step(measured.velocity + noise);
  Controller& controller = around_.controller;
  const double late_s = controller.reference_delay_s();
  const Setpoint reference = moves_ ? setpoint(late_s) : constant_;
  const double command = open_ ? holding_torque_ : controller.command(reference, {measured.angle, velocity});
  const double added = excitation + controller.torque_feedforward(late_s > 0.0 ? setpoint(0.0) : reference);
  const double wanted = command + added;
  double torque = controller.limit(wanted);
  if (!open_) controller.commit(torque == wanted ? command : torque - added);
  if (around_.torque_resolution > 0.0) torque = rounded(torque);
  const double place = drive_->place();
  sensor_.push(drive_->advance(torque));
  ++sample_;
  if (around_.second_output == data::SecondOutput::none)
    return {torque, velocity, reference.velocity, place, 0.0};
  const double second = second_.read().angle;
  second_.push({0.0, drive_->second_output()});
  return {torque, velocity, reference.velocity, place, second};
}

}  // namespace resonid::plant
