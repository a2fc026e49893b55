// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "design/schedule.hpp"

namespace resonid::design {
namespace {

/// What a schedule's frozen loop is at a position.
struct FrozenLoop {
  double settling_s = 0.0;
  std::vector<double> logarithms;  ///< Of its gains, and of what the machine is made of.
};

FrozenLoop frozen_loop(const fit::DriveModel& machine, const FilteredPi& gains) {
  const double radius =
      closed_loop(fit::sampled_states(machine), states_of(gains, machine.sample_time_s)).spectral_radius();
  constexpr double kSettled = 50.0;  // down to 2 %
  FrozenLoop loop;
  loop.settling_s = radius < kStableRadius ? -std::log(kSettled) * machine.sample_time_s / std::log(radius)
                                           : std::numeric_limits<double>::infinity();
  for (const double gain : {gains.kp, gains.ki}) loop.logarithms.push_back(gain > 0.0 ? std::log(gain) : 0.0);
  constexpr std::array kMadeOf = {fit::kDrivenInertia, fit::kMiddleInertia, fit::kLoadInertia,
                                  fit::kStiffness, fit::kStiffness2};
  for (const fit::Parameter p : kMadeOf)
    if (fit::has_parameter(machine.structure, p)) loop.logarithms.push_back(std::log(machine.value(p)));
  return loop;
}

double change_between(const FrozenLoop& a, const FrozenLoop& b) {
  double most = 0.0;
  for (std::size_t i = 0; i < a.logarithms.size(); ++i)
    most = std::max(most, std::abs(b.logarithms[i] - a.logarithms[i]));
  return most;
}

}  // namespace

double slow_speed_of(const MachineAt& machine_at, const GainSchedule& schedule, const Stroke& stroke,
                     std::size_t count) {
  constexpr double kSettlings = 5.0, kChange = 0.1;
  const double length = stroke.to - stroke.from, way = length / static_cast<double>(count - 1);
  double speed = std::numeric_limits<double>::infinity();
  FrozenLoop before;
  for (std::size_t i = 0; i < count; ++i) {
    const double position = stroke.even(i, count);
    FrozenLoop here = frozen_loop(machine_at(position), schedule.at(position));
    speed = std::min(speed, length / (kSettlings * here.settling_s));
    if (i > 0) {
      const double change = change_between(before, here);
      const double settling_s = std::max(before.settling_s, here.settling_s);
      if (change > 0.0) speed = std::min(speed, kChange * way / (change * settling_s));
    }
    before = std::move(here);
  }
  return speed;
}

}  // namespace resonid::design
