// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "monitor/samples/ring.hpp"
#include "monitor/service/installation.hpp"

namespace resonid::monitor {

/// The options of `resonid identify` that say what evidence_report() is told of the axis.
[[nodiscard]] std::string identify_options(const InstalledAxis& axis);

/// The name under which the evidence of an alarm is downloaded.
[[nodiscard]] std::string downloaded_name(std::string_view alarm_id);

/// The `resonid identify` of a file of that name, with its report.
[[nodiscard]] std::string identify_command(const InstalledAxis& axis, const std::string& file);

/// Index of the oldest sample that the ring has; the next one where it has none.
[[nodiscard]] std::uint64_t oldest_sample(const Ring& ring);

struct Stretch {
  std::uint64_t from = 0, to = 0;  ///< Not included.
};
/// What can be copied of it; not the very oldest samples, which may be overwritten meanwhile.
[[nodiscard]] Stretch copied(const Ring& ring, const InstalledAxis& axis, Stretch asked);

/// Raw samples of an axis, as far as the ring has them (copied()), as a recording that `resonid identify`
/// reads; comments say which they are, and the command that gives what the monitor saw.
/// @param name under which people get it
/// @return empty where it has none of them
[[nodiscard]] std::string raw_csv(const Ring& ring, const InstalledAxis& axis, Stretch asked,
                                  const std::string& name);

}  // namespace resonid::monitor
