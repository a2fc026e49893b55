// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/record.hpp>
#include <string>
#include <string_view>

#include "io/units.hpp"

namespace resonid::io {

/// What a column seems to hold, as its name and unit tell.
struct SignalSense {
  enum class Kind { none, time, sample_number, torque, current, velocity, position, acceleration };
  Kind kind = Kind::none;
  bool commanded = false;  ///< Called set-point, command, reference, Soll...
  bool aside = false;      ///< Called a limit, an error, a voltage: neither input nor output.
  bool actual = false;     ///< Called actual, measured, feedback, Ist...
};

/// `base`: the name without its unit. Words of English and German, of drive and controller makers; a unit
/// that is known counts for more than the name.
[[nodiscard]] SignalSense sense_of(std::string_view base, const std::optional<Unit>& unit);

}  // namespace resonid::io
