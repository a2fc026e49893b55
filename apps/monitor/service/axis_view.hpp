// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>

#include "monitor/engine/engine.hpp"
#include "monitor/samples/intake.hpp"
#include "monitor/service/installation.hpp"
#include "monitor/web/backend.hpp"
#include "monitoring/threshold.hpp"

namespace resonid::monitor {

/// What an axis' status is made of.
struct AxisView {
  const InstalledAxis& installed;
  const monitoring::AxisAlarmRules& rules;
  const LiveAxis& live;
  const Intake& intake;
  std::int64_t now_ns = 0, started_ns = 0;  ///< UNIX; the latter of the service.
  double stale_s = 0.0;                     ///< Without samples for so long it is stale.
  /// So much of its ring is still to be taken in that there may be no room for what its source sends.
  bool ring_fills = false;
  struct Due {
    std::uint64_t sample = 0;
    std::int64_t time_ns = 0;  ///< UNIX; 0: not known.
  } due = {};                  ///< What its ring had next at the start.
};
[[nodiscard]] web::AxisStatus status_of(const AxisView& view);

/// Why an axis' newest row is not trusted, or is none, in words; empty: it is.
[[nodiscard]] std::string why_not_trusted(const AxisView& view);

/// Detectors of an axis' changes with the thresholds that they have now; none while nothing is watched.
[[nodiscard]] monitoring::Detectors detectors_of(const monitoring::AxisSpec& spec, const LiveAxis& live);

}  // namespace resonid::monitor
