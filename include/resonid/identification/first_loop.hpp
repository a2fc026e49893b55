// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/identification/tune.hpp>
#include <resonid/identification/tune_export.hpp>
#include <string>

namespace resonid::identification {

/// What is known of a machine before anything is identified. Either the motor's inertia, or the total one
/// with the largest ratio of load to motor; the total one may be left out where the ratio is there.
struct FirstLoopOptions {
  std::optional<double> motor_inertia;  ///< J1, > 0, kgm2: from the data sheet.
  std::optional<double> total_inertia;  ///< J, >= J1, kgm2: from two accelerations.
  std::optional<double> largest_ratio;  ///< Largest J2/J1 that may be, >= 0.
  double sample_rate_hz = 0.0;          ///< > 0
  double delay_s = 0.0;                 ///< From torque to measured velocity, >= 0.
  double torque_lag_s = 0.0;            ///< Time constant of the torque loop, >= 0.
  double least_damping = 0.01;          ///< Least damping ratio of the resonance, > 0 and at most 0.1.
  std::optional<double> torque_limit;   ///< The drive's, for exports, Nm.
};

struct FirstLoop {
  FirstLoopOptions options;
  TunedController controller;  ///< A PI, in SI units; without figures, since there is no machine yet.
  double lag_s = 0.0;          ///< Delay, half a sample and torque lag.
  double crossover_hz = 0.0;   ///< As long as motor and load move as one: kp/(2 pi J).
};

/// A loop soft enough to excite any two-mass machine in (docs/methods/tune.md 13): half the gain up to which
/// all are stable whose ratio of inertias is 0.1 ... 10 and whose resonance is damped by `least_damping` or
/// more, wherever it lies.
[[nodiscard]] expected<FirstLoop, Error> first_loop(const FirstLoopOptions& options);

/// As text for another controller. Not json, which resonid::controller_json() writes, nor klipper.
[[nodiscard]] expected<std::string> exported(const FirstLoop& loop, ExportFormat format,
                                             const ExportNames& names = {});

}  // namespace resonid::identification
