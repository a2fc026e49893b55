// SPDX-License-Identifier: MIT
#include "design/first_loop.hpp"

#include <resonid/base/constants.hpp>

namespace resonid::design {

double total_inertia_of(double torque_up, double acceleration_up, double torque_down,
                        double acceleration_down) {
  return (torque_up - torque_down) / (acceleration_up - acceleration_down);
}

expected<FilteredPi> first_loop(const UnknownMachine& machine) {
  const auto refused = [](const std::optional<double>& value, double least) {
    return value && !(*value >= least && *value > 0.0);
  };
  if (refused(machine.motor_inertia, 0.0))
    return refuse("motor_inertia", "must be > 0", *machine.motor_inertia);
  if (refused(machine.total_inertia, machine.motor_inertia.value_or(0.0)))
    return refuse("total_inertia", "must be > 0 and not less than the motor's", *machine.total_inertia);
  if (machine.largest_ratio && !(*machine.largest_ratio >= 0.0))
    return refuse("largest_ratio", "must be >= 0", *machine.largest_ratio);
  if (!(machine.sample_time_s > 0.0)) return refuse("sample_time_s", "must be > 0", machine.sample_time_s);
  if (!(machine.delay_s >= 0.0)) return refuse("delay_s", "must be >= 0", machine.delay_s);
  if (!(machine.torque_lag_s >= 0.0)) return refuse("torque_lag_s", "must be >= 0", machine.torque_lag_s);
  if (!(machine.least_damping > 0.0 && machine.least_damping <= 0.1))
    return refuse("least_damping", "must be > 0 and at most 0.1", machine.least_damping);
  if (!machine.motor_inertia && !(machine.total_inertia && machine.largest_ratio))
    return refuse("motor_inertia",
                  "must be given, or the total inertia with the largest ratio of load to motor");
  if (!machine.total_inertia && !machine.largest_ratio)
    return refuse("total_inertia", "must be given, or the largest ratio of load to motor");
  if (machine.motor_inertia && machine.total_inertia && machine.largest_ratio)
    return refuse("largest_ratio", "must be left out beside both inertias, which tell it",
                  *machine.largest_ratio);

  const double share = 1.0 + machine.largest_ratio.value_or(0.0);
  const double motor = machine.motor_inertia.value_or(machine.total_inertia.value_or(0.0) / share);
  const double total = machine.total_inertia.value_or(motor * share);
  const double lag_s = machine.delay_s + 0.5 * machine.sample_time_s + machine.torque_lag_s;
  const double kp = motor * kPi * machine.least_damping / lag_s;
  return FilteredPi{kp, kp * kp / (6.0 * total), {}};
}

}  // namespace resonid::design
