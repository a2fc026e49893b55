// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/tune.hpp>
#include <string>

namespace resonid::identification {

/// Units of proportional, integral and derivative gain: "Nm/(rad/s)", "Nm/rad", "Nm/(rad/s2)"; "A/rpm",
/// "A/(rpm s)", "A s/rpm".
struct GainUnits {
  std::string kp, ki, kd;
};
/// Empty where one of the units is.
[[nodiscard]] GainUnits gain_units(const std::string& input, const std::string& velocity);

/// Gains as the drive takes them: with the scales of the recording undone.
struct OwnGains {
  double factor = 1.0;  ///< What every gain, and every term of a numerator, is multiplied by.
  GainUnits units;      ///< Empty where nothing tells them.
};
/// Nothing where the recording is in the units of the result itself.
[[nodiscard]] std::optional<OwnGains> own_gains(const Tuning& tuning);

/// The first step of a proposed controller on a machine: half of every gain, a quarter of an integral one.
inline constexpr double kFirstGain = 0.5, kFirstIntegralGain = 0.25;

}  // namespace resonid::identification
