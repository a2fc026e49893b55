// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "monitor/engine/engine.hpp"
#include "monitor/store/records.hpp"

namespace resonid::monitor {

/// Number of an alarm from its raising, the same whenever that is replayed; below 2^53, as JSON wants it.
[[nodiscard]] std::uint64_t alarm_number(const std::string& axis, monitoring::AlarmId alarm,
                                         std::uint64_t raised_sample);

/// Makes the store's records of alarms from events. What an alarm says is what its raising said, whatever
/// happens to it later.
class AlarmRecords {
 public:
  /// An alarm that the store knows, at the start.
  void know(const AlarmRecord& record);
  /// One that nobody follows any more, and why.
  void close(AlarmRecord record, const std::string& reason, std::int64_t time_ns, Batch& batch);
  /// An event that the store has and that comes again: add() leaves it out then, once.
  void expect(const EventRecord& event) { replayed_.insert(key_of(event)); }
  /// Whether it is new.
  bool add(const std::string& axis, double sample_rate_hz, const Results::TimedEvent& event, Batch& batch);

 private:
  using Key = std::tuple<std::string, std::uint64_t, std::string, std::string, std::uint64_t>;
  static Key key_of(const EventRecord& e) { return {e.axis, e.sample, e.alarm, e.transition, e.action}; }

  std::set<Key> replayed_;
  std::map<std::string, std::string> words_;  // JSON by id, of alarms that are not done with
  /// JSON of who shelved an alarm of an axis and why; empty: nobody did.
  std::map<std::pair<std::string, std::string>, std::string> shelvings_;
};

}  // namespace resonid::monitor
