// SPDX-License-Identifier: MIT
#include "design/setpoint.hpp"

#include <algorithm>
#include <cmath>

#include "design/closed_loop.hpp"
#include "design/course.hpp"

namespace resonid::design {
namespace {

/// The weight changes what the reference does to the controller's states, and nothing else.
ClosedLoop weighted_loop(const Machine& machine, const FilteredPi& controller, double weight) {
  const double step = machine.sample_time_s();
  ClosedLoop loop = closed_loop(machine.states(), states_of(controller, step));
  const auto reference =
      states_of(FilteredPi{weight * controller.kp, controller.ki, controller.biquads}, step);
  loop.reference << reference.d * machine.states().command, reference.b;
  loop.torque_by_reference = reference.d;
  return loop;
}

SetpointStep step_of(const ClosedLoop& loop, double spectral_radius) {
  constexpr double kBand = 0.02;
  const double step = loop.sample_time_s;
  const auto second = static_cast<std::size_t>(std::lround(1.0 / step));
  const std::size_t most = std::max(second, most_samples(spectral_radius));
  SetpointStep found;
  double squares = 0.0;
  Eigen::VectorXd state = Eigen::VectorXd::Zero(loop.a.rows());
  for (std::size_t k = 0; k < most; ++k) {
    const double load = loop.load * state, torque = loop.torque * state + loop.torque_by_reference;
    found.overshoot = std::max(found.overshoot, load - 1.0);
    if (std::abs(load - 1.0) > kBand) found.settling_s = static_cast<double>(k + 1) * step;
    found.peak_torque = std::max(found.peak_torque, std::abs(torque));
    if (k < second) squares += torque * torque;
    state = (loop.a * state + loop.reference).eval();
  }
  found.rms_torque_1s = std::sqrt(squares / static_cast<double>(second));
  return found;
}

}  // namespace

SetpointStep setpoint_step_of(const Machine& machine, const FilteredPi& controller, double weight) {
  const ClosedLoop loop = weighted_loop(machine, controller, weight);
  return step_of(loop, loop.spectral_radius());
}

std::optional<double> largest_weight(const Machine& machine, const FilteredPi& controller, double overshoot) {
  const double radius = weighted_loop(machine, controller, 1.0).spectral_radius();
  if (!(radius < kStableRadius)) return std::nullopt;
  const auto too_much = [&](double weight) {
    return step_of(weighted_loop(machine, controller, weight), radius).overshoot > overshoot;
  };
  if (!too_much(1.0)) return 1.0;
  // The load's velocity is linear in the weight, so that its largest value is convex: what is allowed is an
  // interval.
  if (too_much(0.0)) return 0.0;
  double low = 0.0, high = 1.0;
  constexpr int kHalvings = 30;
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    (too_much(middle) ? high : low) = middle;
  }
  return low;
}

}  // namespace resonid::design
