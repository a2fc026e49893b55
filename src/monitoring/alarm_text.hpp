// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <functional>
#include <monitoring/axis_alarms.hpp>
#include <resonid/identification/result.hpp>
#include <string>

namespace resonid::monitoring {

/// How people read what an axis says.
struct AlarmWords {
  std::function<std::string(std::uint64_t)> time;  ///< A sample's time as text: "14:02:10".
  bool linear = false;                             ///< Masses and forces; kg, N and m.
  identification::Units units = {};                ///< Told where they are not physical.
  /// A UNIX time (ns) as text, for ends by the clock, of which samples that have stopped tell nothing; empty:
  /// by samples.
  std::function<std::string(std::int64_t)> clock = {};
  bool refused = false;  ///< With the alarm `stale`: samples come, but none that can be used.
};

/// An alarm's transition as a sentence without a full stop, in ASCII: what changed, since when, how much +-
/// its standard deviation, and the likely cause:
///
///     Stiffness fell by 5.15 +- 0.40 % (143.80 -> 136.40 Nm/rad) since 14:02:10; likely cause: belt or
///     coupling looser (inertias unchanged)
[[nodiscard]] std::string alarm_text(const AlarmEvent& event, const AlarmWords& words);

/// What ranked causes come to: "likely cause: ...", "possible cause: ... or ...", "cause unknown"; empty
/// where none was looked for.
[[nodiscard]] std::string cause_text(const LikelyCause& cause);

}  // namespace resonid::monitoring
