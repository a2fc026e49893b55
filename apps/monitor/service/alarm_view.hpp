// SPDX-License-Identifier: MIT
#pragma once

#include "monitor/store/records.hpp"
#include "monitor/web/backend.hpp"

namespace resonid::monitor {

/// A stored alarm as people see it.
[[nodiscard]] web::Alarm alarm_of(const AlarmRecord& record);
[[nodiscard]] web::AlarmEvent event_of(const EventRecord& record);

}  // namespace resonid::monitor
