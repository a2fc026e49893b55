// SPDX-License-Identifier: MIT
#include "design/first_loop.hpp"

#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/identification/first_loop.hpp>

#include "identification/tune/law.hpp"

namespace resonid::identification {

expected<FirstLoop, Error> first_loop(const FirstLoopOptions& options) {
  if (!(options.sample_rate_hz > 0.0 && std::isfinite(options.sample_rate_hz)))
    return refuse("sample_rate_hz", "must be > 0", options.sample_rate_hz);
  if (options.torque_limit && !(*options.torque_limit > 0.0 && std::isfinite(*options.torque_limit)))
    return refuse("torque_limit", "must be > 0", *options.torque_limit);
  design::UnknownMachine machine;
  machine.motor_inertia = options.motor_inertia;
  machine.total_inertia = options.total_inertia;
  machine.largest_ratio = options.largest_ratio;
  machine.delay_s = options.delay_s;
  machine.torque_lag_s = options.torque_lag_s;
  machine.sample_time_s = 1.0 / options.sample_rate_hz;
  machine.least_damping = options.least_damping;
  const auto gains = design::first_loop(machine);
  if (!gains) return tl::unexpected(gains.error());
  FirstLoop loop;
  loop.options = options;
  loop.controller = law_of(*gains, machine.sample_time_s).what;
  loop.lag_s = options.delay_s + 0.5 * machine.sample_time_s + options.torque_lag_s;
  const double total = gains->kp * gains->kp / (6.0 * gains->ki);
  loop.crossover_hz = gains->kp / (kTwoPi * total);
  return loop;
}

}  // namespace resonid::identification
