// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <resonid/base/expected.hpp>
#include <string_view>

namespace resonid::online {

/// What the growth of an oscillation is looked for in.
enum class OscillationSignal { velocity, torque };

/// Limits of a machine and how the excitation keeps clear of them. Units of the driven side: Nm, rad, rad/s;
/// N, m, m/s for linear motion. A limit that is 0 is not watched.
struct GuardedExcitationConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which the guard is stepped, > 0 (Hz).
  double amplitude = 0.0;       ///< The excitation is clipped to this, > 0 (Nm).
  double ramp_in_s = 0.5;       ///< Raised cosine at the start, >= 0 (s).
  double ramp_out_s = 0.5;      ///< Likewise at the end and when it is stopped, >= 0 (s).
  double trip_ramp_s = 0.0;     ///< Likewise when a limit stops it; 0: at once (s).
  double duration_s = 0.0;      ///< Length of the injection, both ramps included; 0: until it is stopped (s).
  double margin = 0.9;          ///< Share of each of the machine's limits at which it stops, in (0, 1].
  double torque_limit = 0.0;    ///< The drive's, held against the command with the excitation; 0: none (Nm).
  /// The torque given is that of the last sample with the excitation in it, not the controller's of this one.
  bool torque_is_total = false;
  double velocity_limit = 0.0;  ///< The machine's, either way; 0: none (rad/s).
  double position_low = 0.0;    ///< Lower end of travel; both ends 0: none (rad).
  double position_high = 0.0;   ///< Upper end of travel (rad).
  /// Deceleration that the machine is sure to reach, > 0 with a position window (rad/s2).
  double deceleration = 0.0;
  /// Acceleration that the machine may still have until it reacts; 0: left out (rad/s2).
  double largest_acceleration = 0.0;
  /// Delay of the measurements and of the stop, beside a sample and trip_ramp_s, >= 0 (s).
  double reaction_s = 0.0;
  /// What is watched for growing oscillation: velocity or torque.
  OscillationSignal oscillation_signal = OscillationSignal::velocity;
  double oscillation_from_hz = 0.0;  ///< Lower end of the band that is watched; 0: not watched (Hz).
  double oscillation_least = 0.0;    ///< Rms below which nothing is an oscillation, > 0 (rad/s or Nm).
  /// Rms that a normal run reaches at most; 0: learned from its beginning (rad/s or Nm).
  double oscillation_expected = 0.0;
  double oscillation_growth = 3.0;    ///< Factor over what is expected that stops it, > 1.
  double oscillation_window_s = 0.0;  ///< Time constant of the rms; 0: 3/oscillation_from_hz (s).
  /// Time after the ramp in during which what is normal is learned, >= 0 (s).
  double oscillation_learn_s = 1.0;
  double lost_s = 0.01;          ///< Longest time without a measurement that a limit needs, >= 0 (s).
  double watch_limit = 0.0;      ///< Largest amplitude that watch() may be given; 0: any.
  double watch_timeout_s = 0.0;  ///< Longest time between two calls of watch(); 0: any (s).

  [[nodiscard]] bool has_window() const noexcept { return position_low != 0.0 || position_high != 0.0; }
};

/// Refuses what could not guard.
[[nodiscard]] inline std::optional<Error> check(const GuardedExcitationConfig& c) noexcept {
  const auto positive = [](double x) { return x > 0.0 && std::isfinite(x); };
  const auto natural = [](double x) { return x >= 0.0 && std::isfinite(x); };
  if (!positive(c.sample_rate_hz)) return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
  if (!positive(c.amplitude)) return Error{"amplitude", "must be > 0", c.amplitude};
  if (!(c.margin > 0.0 && c.margin <= 1.0)) return Error{"margin", "must lie in (0, 1]", c.margin};
  const struct {
    std::string_view field;
    double value;
  } at_least_0[] = {{"ramp_in_s", c.ramp_in_s},
                    {"ramp_out_s", c.ramp_out_s},
                    {"trip_ramp_s", c.trip_ramp_s},
                    {"duration_s", c.duration_s},
                    {"torque_limit", c.torque_limit},
                    {"velocity_limit", c.velocity_limit},
                    {"deceleration", c.deceleration},
                    {"largest_acceleration", c.largest_acceleration},
                    {"reaction_s", c.reaction_s},
                    {"oscillation_from_hz", c.oscillation_from_hz},
                    {"oscillation_least", c.oscillation_least},
                    {"oscillation_expected", c.oscillation_expected},
                    {"oscillation_window_s", c.oscillation_window_s},
                    {"oscillation_learn_s", c.oscillation_learn_s},
                    {"lost_s", c.lost_s},
                    {"watch_limit", c.watch_limit},
                    {"watch_timeout_s", c.watch_timeout_s}};
  for (const auto& f : at_least_0)
    if (!natural(f.value)) return Error{f.field, "must be >= 0", f.value};
  if (c.duration_s > 0.0 && c.duration_s < c.ramp_in_s + c.ramp_out_s)
    return Error{"duration_s", "must have room for both ramps", c.duration_s};
  if (c.has_window() &&
      !(c.position_low < c.position_high && std::isfinite(c.position_high - c.position_low)))
    return Error{"position_high", "must be above position_low", c.position_high};
  if (c.has_window() && !(c.deceleration > 0.0))
    return Error{"deceleration", "must be > 0 with a position window", c.deceleration};
  if (c.oscillation_from_hz > 0.0) {
    if (!(c.oscillation_from_hz < 0.5 * c.sample_rate_hz))
      return Error{"oscillation_from_hz", "must be below half the sample rate", c.oscillation_from_hz};
    if (!(c.oscillation_least > 0.0)) return Error{"oscillation_least", "must be > 0", c.oscillation_least};
    if (!(c.oscillation_growth > 1.0 && std::isfinite(c.oscillation_growth)))
      return Error{"oscillation_growth", "must be > 1", c.oscillation_growth};
  }
  const double reaction_s = c.reaction_s + c.trip_ramp_s + 1.0 / c.sample_rate_hz;
  if (c.velocity_limit > 0.0 && !(c.margin * c.velocity_limit > c.largest_acceleration * reaction_s))
    return Error{"velocity_limit", "must leave room for the acceleration until the machine reacts",
                 c.velocity_limit};
  return std::nullopt;
}

}  // namespace resonid::online
