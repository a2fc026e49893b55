// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>

#include "monitor/store/records.hpp"
#include "monitor/web/backend.hpp"

namespace resonid::monitor {

/// A stored alarm as people see it.
[[nodiscard]] web::Alarm alarm_of(const AlarmRecord& record);
[[nodiscard]] web::AlarmEvent event_of(const EventRecord& record);
/// What Reader::active_alarms() counted.
[[nodiscard]] web::AlarmCounts counts_of(const std::map<int, std::uint64_t>& by_severity);

}  // namespace resonid::monitor
