// SPDX-License-Identifier: MIT
#pragma once

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

/// SI units of the motion: Nm or N; rad/s, rad, rad/s2 or m/s, m, m/s2.
[[nodiscard]] std::string input_si_unit(data::Motion motion);
[[nodiscard]] std::string output_si_unit(data::Motion motion, data::OutputQuantity quantity);

}  // namespace resonid::io
