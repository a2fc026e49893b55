// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "monitor/web/backend.hpp"

namespace resonid::monitor::web {

/// A request's query, decoded, as the HTTP library keeps it.
using Query = std::multimap<std::string, std::string>;

/// Requests in words of the backend. Whatever comes in, either a checked value or a Problem comes out.
inline constexpr std::uint32_t kMostPoints = 20'000;  ///< Of a history.
inline constexpr std::uint32_t kMostAlarms = 1000;    ///< In one answer; audit entries likewise.

/// [A-Za-z0-9_.-]{1,64}, but neither "." nor "..".
[[nodiscard]] bool is_axis_name(std::string_view) noexcept;
[[nodiscard]] Answer<std::uint64_t> alarm_id(std::string_view);

/// figure=a,b (all without), from, to (the last hour without), points (1000 without).
[[nodiscard]] Answer<HistoryQuestion> history_question(const Query&, double now_s);

struct Interval {
  double from_s = 0.0, to_s = 0.0;
};
inline constexpr double kLongestRaw = 3600.0;  ///< s; of raw samples in one answer
[[nodiscard]] Answer<Interval> raw_interval(const Query&);

/// a, b: two times, both required.
[[nodiscard]] Answer<Interval> compared_times(const Query&);

/// state, axis, limit (100 without), from, to (all of time without).
[[nodiscard]] Answer<AlarmQuestion> alarm_question(const Query&);
/// limit (100 without), from, to (all of time without).
[[nodiscard]] Answer<AuditQuestion> audit_question(const Query&);

/// Body of an action: "who" and "reason" (1 ... 200 characters; a reason is required to shelve and for
/// maintenance), and for these an end as "seconds" from now or "until_time_s", at most a year ahead.
[[nodiscard]] Answer<Action> action_of(ActionKind, std::string_view body, double now_s);

}  // namespace resonid::monitor::web
