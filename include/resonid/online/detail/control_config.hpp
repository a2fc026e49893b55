// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <resonid/base/expected.hpp>
#include <span>

namespace resonid::online {

/// (s^2 + 2 zn w s + w^2)/(s^2 + 2 zd w s + w^2) by Tustin's rule, prewarped at its own frequency; 1 at
/// standstill (docs/methods/tune.md 6.1).
struct Biquad {
  double frequency_hz = 0.0;         ///< > 0 and below half the sample rate.
  double numerator_damping = 1.0;    ///< zn, >= 0.
  double denominator_damping = 1.0;  ///< zd, > 0.
};

/// Gains at a position.
struct GainNode {
  double position = 0.0;  ///< In the unit of the measured position.
  double kp = 0.0;        ///< >= 0.
  double ki = 0.0;        ///< >= 0.
};

struct DriveControlConfig {
  double sample_rate_hz = 0.0;    ///< Rate at which step() is called, > 0.
  double kp = 0.0;                ///< Nm/(rad/s), >= 0; 0 where a schedule gives it.
  double ki = 0.0;                ///< Nm/rad, >= 0; 0 where a schedule gives it.
  double set_point_weight = 1.0;  ///< b, 0 ... 1; 1 where kv is used.
  double torque_limit = std::numeric_limits<double>::infinity();  ///< Nm, > 0.
  std::span<const Biquad> biquads = {};                           ///< In series; copied.
  std::span<const GainNode> schedule = {};  ///< Ascending in position; empty: kp and ki everywhere. Copied.
  double kv = 0.0;                          ///< 1/s, > 0 where the reference is a position, else 0.
  /// The position is the sum of the measured velocity, not measured; it begins at 0.
  bool sums_velocity = false;
  std::uint32_t longest_gap_samples = 2;  ///< Missing samples in a row over which the torque stays.
};

/// A biquad in powers of z^-1, a0 = 1.
struct BiquadCoefficients {
  double b0 = 1.0, b1 = 0.0, b2 = 0.0, a1 = 0.0, a2 = 0.0;
};
[[nodiscard]] BiquadCoefficients coefficients_of(const Biquad& biquad, double sample_rate_hz) noexcept;
/// Largest relative error of its response when the coefficients are rounded to floats. It is looked for where
/// it is found: at standstill, at the Nyquist frequency, and where numerator and denominator are smallest.
[[nodiscard]] double float_error(const BiquadCoefficients& c) noexcept;

/// What every filter and every schedule must be; `in_float`: no biquad may lose its shape in single precision
/// (docs/methods/tune.md 16.4).
[[nodiscard]] expected<void> check_biquads(std::span<const Biquad> biquads, std::size_t most,
                                           double sample_rate_hz, bool in_float) noexcept;
[[nodiscard]] expected<void> check_nodes(std::span<const GainNode> nodes, std::size_t most) noexcept;
[[nodiscard]] expected<void> check_gains(double kp, double ki) noexcept;
/// All of it.
[[nodiscard]] expected<void> check(const DriveControlConfig& config, std::size_t most_biquads,
                                   std::size_t most_nodes, bool in_float) noexcept;

}  // namespace resonid::online
