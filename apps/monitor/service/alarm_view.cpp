// SPDX-License-Identifier: MIT
#include "monitor/service/alarm_view.hpp"

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "monitor/engine/engine.hpp"
#include "monitor/service/answers.hpp"

namespace resonid::monitor {
namespace {

using detail::seconds;
using web::kUnknown;
using Json = nlohmann::json;

constexpr std::int64_t kGathering_ns = 15'000'000'000;

web::AlarmChange change_of(const Json& json) {
  return {json.value("before", kUnknown), json.value("after", kUnknown),    json.value("size", kUnknown),
          json.value("std", kUnknown),    json.value("relative", kUnknown), json.value("sigma", kUnknown)};
}

monitoring::Severity severity_of(int stored) {
  return static_cast<monitoring::Severity>(std::clamp(stored, 0, 2));
}

}  // namespace

web::Alarm alarm_of(const AlarmRecord& r) {
  const Json json = Json::parse(r.json, nullptr, false);
  web::Alarm a;
  a.id = std::strtoull(r.id.c_str(), nullptr, 10);
  a.axis = r.axis;
  a.alarm = r.alarm;
  a.severity = severity_of(r.severity);
  a.active = r.active;
  a.acknowledged = r.acknowledged;
  a.latched = r.latched;
  a.raised_time_s = seconds(r.raised_ns);
  // Soon after the alarm they are still being gathered.
  a.evidence = r.evidence || (!r.axis.empty() && now_ns() - r.raised_ns < kGathering_ns);
  if (r.cleared_ns) a.cleared_time_s = seconds(*r.cleared_ns);
  if (!json.is_object()) return a;
  a.text = json.value("text", "");
  a.cause = json.value("cause", "");
  a.suppressed = json.value("suppressed", "");
  a.since_time_s = seconds(json.value("since_ns", std::int64_t{0}));
  if (r.shelved_until_ns) {
    const Json by = json.value("shelved", Json::object());
    a.shelved =
        web::Alarm::Shelved{seconds(*r.shelved_until_ns), by.value("reason", ""), by.value("who", "")};
  }
  if (json.contains("change")) a.change = change_of(json["change"]);
  return a;
}

web::AlarmEvent event_of(const EventRecord& e) {
  const Json json = Json::parse(e.json, nullptr, false);
  web::AlarmEvent event{seconds(e.time_ns), e.sample, e.transition, "", e.text, "", "", {}};
  if (!json.is_object()) return event;
  event.state = json.value("state", "");
  event.who = json.value("who", "");
  event.reason = json.value("reason", "");
  if (json.contains("change")) event.change = change_of(json["change"]);
  return event;
}

web::AlarmCounts counts_of(const std::map<int, std::uint64_t>& by_severity) {
  web::AlarmCounts counts{};
  for (const auto& [severity, count] : by_severity)
    counts[static_cast<std::size_t>(severity_of(severity))] += count;
  return counts;
}

}  // namespace resonid::monitor
