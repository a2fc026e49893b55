// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/record.hpp>
#include <string>
#include <string_view>

namespace resonid::io {

/// A column's name taken apart: "iq_meas_A" is "iq_meas" in "A", "speed [rad/s]" is "speed" in "rad/s".
struct NamedUnit {
  std::string base;
  std::string unit;  ///< Empty when the name tells none.
};
[[nodiscard]] NamedUnit take_apart(std::string_view column);

/// The suffix that stands for a unit ("_rad_s" for "rad/s"), empty when there is none.
[[nodiscard]] std::string suffix_of(std::string_view unit);

/// What a unit measures.
enum class Dimension {
  time,
  angle,
  angular_velocity,
  angular_acceleration,
  length,
  velocity,
  acceleration,
  torque,
  force,
  current,
  voltage,
  ratio,       ///< Per cent or per mille of something rated.
  counts,      ///< Increments of an encoder.
  count_rate,  ///< Increments per second.
};

struct Unit {
  Dimension dimension = Dimension::time;
  double factor = 1.0;  ///< Of the unit in that of its dimension: rad, rad/s, m, Nm, N, A, V, s, 1, counts.
};

/// The unit that a text stands for, whatever its spelling: "1/min", "min^-1", "U/min", "rpm"; "°/s", "deg/s".
[[nodiscard]] std::optional<Unit> known_unit(std::string_view text);
/// The unit that numbers of a dimension are converted to, "rad/s"; "%" and "counts" of those without one.
[[nodiscard]] std::string_view base_unit(Dimension dimension) noexcept;

/// What an output of that dimension is; nothing for what is no motion.
[[nodiscard]] std::optional<data::OutputQuantity> quantity_of(Dimension dimension) noexcept;
/// Rotary of angles and torques, linear of lengths and forces; nothing for what either may have.
[[nodiscard]] std::optional<data::Motion> motion_of(Dimension dimension) noexcept;

/// SI units of the motion: Nm or N; rad/s, rad, rad/s2 or m/s, m, m/s2.
[[nodiscard]] std::string input_si_unit(data::Motion motion);
[[nodiscard]] std::string output_si_unit(data::Motion motion, data::OutputQuantity quantity);

}  // namespace resonid::io
