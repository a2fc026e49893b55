// SPDX-License-Identifier: MIT
#include "monitor/service/disk_alarm.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "monitor/service/alarm_record.hpp"
#include "monitoring/alarm_settings.hpp"

namespace resonid::monitor {
namespace {

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::int64_t kOnDelay_ns = 1000 * kMillisecond_ns, kOffDelay_ns = 10'000 * kMillisecond_ns;

}  // namespace

void DiskAlarm::know(const AlarmRecord& record) {
  record_ = record;
  if (!record.active) return;
  const bool failing = record.severity == static_cast<int>(monitoring::Severity::high);
  state_ = next_ = failing ? State::failing : State::over_limit;
}

void DiskAlarm::look(const std::string& fault, const std::string& over_limit, std::int64_t now_ns,
                     Batch& batch) {
  const State now = !fault.empty() ? State::failing : !over_limit.empty() ? State::over_limit : State::well;
  if (now != next_) {
    next_ = now;
    next_since_ns_ = now_ns;
  }
  if (next_ == state_ || now_ns - next_since_ns_ < (next_ > state_ ? kOnDelay_ns : kOffDelay_ns)) return;
  const State before = state_;
  state_ = next_;
  record_.severity =
      static_cast<int>(state_ == State::failing ? monitoring::Severity::high : monitoring::Severity::medium);
  if (state_ == State::well) return tell("cleared", "There is room on the disk again", now_ns, batch);
  if (before == State::well) {
    record_.id.clear();
    record_.raised_ns = now_ns;
    record_.cleared_ns.reset();
  }
  tell(before == State::well ? "raised" : "realarmed", state_ == State::failing ? fault : over_limit, now_ns,
       batch);
}

/// Milliseconds stand for samples, which the installation has none of.
void DiskAlarm::tell(const char* transition, std::string text, std::int64_t now_ns, Batch& batch) {
  auto& r = record_;
  r.sample =
      std::max(r.sample + 1, static_cast<std::uint64_t>(std::max<std::int64_t>(0, now_ns / kMillisecond_ns)));
  if (r.id.empty()) {
    r.id = std::to_string(alarm_number({}, {}, r.sample));
    r.alarm = kName;
  }
  r.active = r.open = state_ != State::well;
  r.acknowledged = true;
  if (r.active)  // the text names a path, which may be any bytes
    r.json = nlohmann::json{{"text", text}, {"since_ns", next_since_ns_}}.dump(
        -1, ' ', false, nlohmann::json::error_handler_t::replace);
  else
    r.cleared_ns = now_ns;
  batch.alarms.push_back(r);
  const nlohmann::json told{{"state", r.active ? "active" : "cleared"}};
  batch.events.push_back({r.axis, r.sample, r.alarm, transition, r.id, now_ns, std::move(text), told.dump()});
}

}  // namespace resonid::monitor
