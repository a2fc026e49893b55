// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <string>

#include "monitor/samples/ring.hpp"
#include "monitor/service/installation.hpp"

namespace resonid::monitor {

/// The options of `resonid identify` that say what evidence_report() is told of the axis.
[[nodiscard]] std::string identify_options(const InstalledAxis& axis);

/// Index of the oldest sample that the ring has; the next one where it has none.
[[nodiscard]] std::uint64_t oldest_sample(const Ring& ring);

/// Raw samples `from` to `to` (not included) of an axis, as far as the ring has them, as a recording that
/// `resonid identify` reads; comments say which they are, and with which options it gives what the monitor
/// saw. Empty where it has none of them.
[[nodiscard]] std::string raw_csv(const Ring& ring, const InstalledAxis& axis, std::uint64_t from,
                                  std::uint64_t to);

}  // namespace resonid::monitor
