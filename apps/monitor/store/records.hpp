// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <monitoring/row.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::monitor {

/// An axis and what its statistics need. Recorded by each row, snapshot ... of an unknown name as well.
struct AxisRecord {
  std::string axis;       ///< Empty: the installation.
  double memory_s = 0.0;  ///< Rows so far apart have errors correlated by 1/e.
};

/// A configuration's text, kept for ever by its hash (configuration_hash()).
struct ConfigurationRecord {
  std::string text;
  std::int64_t time_ns = 0;  ///< First use; later ones change nothing.
};

/// Rows of an axis are added in the order of their samples: one at or before the newest is known already.
struct RowRecord {
  std::string axis;
  std::int64_t time_ns = 0;
  monitoring::Row row;
};

/// From where to go on after a restart. The newest two of an axis are kept; one that is not newer is known.
struct SnapshotRecord {
  std::string axis;
  std::uint64_t sample = 0, position = 0;
  std::string version;             ///< The library's: whoever reads `bytes` must be the same.
  std::string configuration_hash;  ///< And the same configuration.
  std::vector<std::byte> bytes;
};

/// Where an axis' ring stood: after a power cut, which it does not survive, source and count go on from here.
/// The last one written counts.
struct PositionRecord {
  std::string axis;
  std::uint64_t next_sample = 0, sender_offset = 0;
  std::array<std::uint64_t, 4> word{};  ///< How far the source had been read.
};

/// State of an alarm after `sample`. An older state than the stored one changes nothing.
struct AlarmRecord {
  std::string id;     ///< Of this raising of the alarm.
  std::string axis;   ///< Empty: the installation.
  std::string alarm;  ///< Figure or condition.
  std::uint64_t sample = 0;
  int severity = 0;
  bool active = false, acknowledged = false, latched = false, suppressed = false;
  bool open = true;  ///< Not done with: active, unacknowledged, latched or shelved; nor raised again.
  std::optional<std::int64_t> shelved_until_ns;
  std::int64_t raised_ns = 0;
  std::optional<std::int64_t> cleared_ns;
  std::string json;          ///< All else of it.
  bool evidence = false;     ///< Read only: whether a file with the samples around it is kept.
  bool begins_anew = false;  ///< Whatever the store has; then any sample is newer.
};

/// One transition of an alarm; written once per (axis, sample, alarm, transition, action).
struct EventRecord {
  std::string axis;
  std::uint64_t sample = 0;
  std::string alarm, transition;
  std::string alarm_id;
  std::int64_t time_ns = 0;
  std::string text, json;
  std::uint64_t action = 0;  ///< That led to it, which may do so again before the next sample; 0: samples.
};

/// What a person or the service did, as an input of the engine: replay reads them in this order again.
struct ActionRecord {
  std::string key;           ///< Of this action alone; a second one with it changes nothing.
  std::string axis;          ///< Empty: the installation.
  std::uint64_t sample = 0;  ///< It acts before this one.
  std::int64_t time_ns = 0;
  std::string kind, who, reason;
  std::string arguments;  ///< JSON
};

/// What the machine was when all was well; written once per (axis, sample, name).
struct BaselineRecord {
  std::string axis;
  std::uint64_t sample = 0;
  std::int64_t time_ns = 0;
  std::string name, who, reason;
  monitoring::Row figures;
  std::vector<std::byte> bytes;  ///< What else belongs to it: the response.
};

/// A file with raw samples around an alarm.
struct EvidenceRecord {
  std::string file;  ///< Its name; one record per file.
  std::string alarm_id, axis;
  std::uint64_t from_sample = 0, to_sample = 0;
  std::int64_t time_ns = 0;
  std::uint64_t bytes = 0;  ///< Size of the file and its report, which counts as the store's.
};
/// What such a file takes with the report that was made of it.
struct EvidenceSize {
  std::string file;
  std::uint64_t bytes = 0;
};

/// A message to the outside; sent at least once. One per key, for as long as the key is remembered.
struct OutboxRecord {
  std::string key;
  std::string target;  ///< Name of a webhook, an MQTT topic ...
  std::string payload;
  std::int64_t created_ns = 0;
};

/// What became of a message of the outbox.
struct DeliveryRecord {
  std::string key;
  std::int64_t time_ns = 0;
  std::optional<std::int64_t>
      next_try_ns;             ///< Failed, to be tried again then; nothing: delivered or given up.
  std::string text;            ///< Why it failed.
  bool all_of_target = false;  ///< `key` is a target's name: all that waits for it is given up.
};

/// All of the last 200 ms; one transaction.
struct Batch {
  std::vector<AxisRecord> axes;
  std::vector<ConfigurationRecord> configurations;
  std::vector<RowRecord> rows;
  std::vector<SnapshotRecord> snapshots;
  std::vector<PositionRecord> positions;
  std::vector<AlarmRecord> alarms;
  std::vector<EventRecord> events;
  std::vector<ActionRecord> actions;
  std::vector<BaselineRecord> baselines;
  std::vector<EvidenceRecord> evidence;  ///< One that is there becomes this.
  std::vector<EvidenceSize> evidence_sizes;
  std::vector<std::string>
      evidence_removed;                    ///< Files that are gone as asked for (Reader::evidence_to_remove).
  std::vector<std::string> evidence_lost;  ///< Files that are gone.
  std::vector<OutboxRecord> outbox;
  std::vector<DeliveryRecord> deliveries;
};

/// 64 hexadecimal digits of SHA-256.
[[nodiscard]] std::string configuration_hash(std::string_view text);

}  // namespace resonid::monitor
