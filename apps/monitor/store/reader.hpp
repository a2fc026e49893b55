// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <monitor/store/records.hpp>
#include <monitor/store/store_error.hpp>
#include <monitor/store/summary.hpp>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::monitor {

/// What the points of a history are made of.
enum class Resolution : std::uint8_t { row, five_minutes, hour, day };
inline constexpr EnumName<Resolution> kResolutionNames[] = {{Resolution::row, "row"},
                                                            {Resolution::five_minutes, "five-minutes"},
                                                            {Resolution::hour, "hour"},
                                                            {Resolution::day, "day"}};
[[nodiscard]] constexpr std::span<const EnumName<Resolution>> enum_names(Resolution) noexcept {
  return kResolutionNames;
}

struct HistoryQuery {
  std::string axis;
  std::vector<monitoring::Watched> figures;
  std::int64_t from_ns = 0, to_ns = 0;   ///< The latter not included.
  std::size_t points = 1000;             ///< At most so many, 1 ... 100 000.
  std::optional<Resolution> resolution;  ///< Nothing: the finest that is there and read fast enough.
};

/// Figures over equal steps of time; steps without rows are left out.
struct History {
  Resolution resolution = Resolution::row;
  double step_s = 0.0;
  std::vector<std::int64_t> time_ns;                ///< Mean over what each point is made of.
  std::vector<std::vector<FigureSummary>> figures;  ///< [figure of the query][point]
};

/// What a figure was about an instant.
struct Then {
  FigureSummary summary;
  Resolution resolution = Resolution::row;
  std::int64_t from_ns = 0, to_ns = 0;  ///< What it was taken from.
};

/// One figure at two times.
struct Difference {
  monitoring::Watched figure{};
  std::optional<Then> a, b;  ///< Nothing: no trusted rows within a week.
  double difference = FigureSummary::kUnknown, std = FigureSummary::kUnknown;  ///< b - a
  double sigma = FigureSummary::kUnknown;                                      ///< |difference| / std
  double chance = FigureSummary::kUnknown;  ///< That it is so large or larger although nothing changed.
};

/// UNIX times, the latter not included; all of time without.
struct TimeSpan {
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::min();
  std::int64_t to_ns = std::numeric_limits<std::int64_t>::max();
};

struct StoredAxis {
  std::string axis;
  double memory_s = 0.0;
  std::optional<std::uint64_t> newest_sample;  ///< Of its rows; a row at or before it is known.
};

struct StoredSnapshot {
  SnapshotRecord snapshot;
  bool previous = false;  ///< The newest was damaged.
};

struct StoredConfiguration {
  std::string hash, text;
  std::int64_t first_time_ns = 0;
};

struct StoredMessage {
  OutboxRecord message;
  std::uint64_t tries = 0;
  std::string text;  ///< Why the last try failed.
};

enum class AlarmFilter : std::uint8_t { all, open, active, unacknowledged, shelved, cleared };
inline constexpr EnumName<AlarmFilter> kAlarmFilterNames[] = {
    {AlarmFilter::all, "all"},         {AlarmFilter::open, "open"},
    {AlarmFilter::active, "active"},   {AlarmFilter::unacknowledged, "unacknowledged"},
    {AlarmFilter::shelved, "shelved"}, {AlarmFilter::cleared, "cleared"}};
[[nodiscard]] constexpr std::span<const EnumName<AlarmFilter>> enum_names(AlarmFilter) noexcept {
  return kAlarmFilterNames;
}

/// Reads an installation's database, which a Store of this or another process may write meanwhile. Used by
/// one thread at a time. Every call is a read-only transaction of its own that sees one state of all. An
/// unknown axis has nothing. Nothing throws.
class Reader {
 public:
  class Impl;
  [[nodiscard]] static expected<Reader, StoreError> open(const std::string& path);
  Reader(Reader&&) noexcept;
  Reader& operator=(Reader&&) noexcept;
  ~Reader();

  [[nodiscard]] expected<std::string, StoreError> installation();
  [[nodiscard]] expected<std::vector<StoredAxis>, StoreError> axes();
  [[nodiscard]] expected<std::optional<StoredConfiguration>, StoreError> configuration(std::string_view hash);
  /// The newest that is whole.
  [[nodiscard]] expected<std::optional<StoredSnapshot>, StoreError> snapshot(std::string_view axis);
  [[nodiscard]] expected<std::optional<PositionRecord>, StoreError> position(std::string_view axis);
  /// From a sample on, in the order in which they act: by sample, then as recorded.
  [[nodiscard]] expected<std::vector<ActionRecord>, StoreError> actions(std::string_view axis,
                                                                        std::uint64_t from_sample,
                                                                        std::size_t limit);
  /// The one recorded last.
  [[nodiscard]] expected<std::optional<ActionRecord>, StoreError> newest_action(std::string_view axis);
  /// Rows as they were written, in the order of time.
  [[nodiscard]] expected<std::vector<RowRecord>, StoreError> rows(std::string_view axis, std::int64_t from_ns,
                                                                  std::int64_t to_ns, std::size_t limit);
  [[nodiscard]] expected<History, StoreError> history(const HistoryQuery& query);
  /// Figures that are there at either time, from the rows of ten minutes around it (less where the times are
  /// closer), else from the nearest hour or day, with 30 trusted rows at least; a figure that has none in the
  /// stretch that is nearest of all figures' is not there. Nothing where the stretches of both overlap.
  [[nodiscard]] expected<std::vector<Difference>, StoreError> compare(std::string_view axis,
                                                                      std::int64_t a_ns, std::int64_t b_ns);
  /// The last raised first; `axis`: nothing for all. Those that were open at some time within `span`.
  [[nodiscard]] expected<std::vector<AlarmRecord>, StoreError> alarms(AlarmFilter filter,
                                                                      const std::optional<std::string>& axis,
                                                                      std::size_t limit,
                                                                      const TimeSpan& span = {});
  /// How many are open and active, by severity; as if the states `newer` of different alarms were written.
  [[nodiscard]] expected<std::map<int, std::uint64_t>, StoreError> active_alarms(
      std::span<const AlarmRecord> newer);
  [[nodiscard]] expected<std::optional<AlarmRecord>, StoreError> alarm(std::string_view id);
  /// As they happened.
  [[nodiscard]] expected<std::vector<EventRecord>, StoreError> events(std::string_view alarm_id,
                                                                      std::size_t limit);
  /// Of all alarms of an axis, from a sample on.
  [[nodiscard]] expected<std::vector<EventRecord>, StoreError> events_from(std::string_view axis,
                                                                           std::uint64_t sample,
                                                                           std::size_t limit);
  /// Actions of all axes within `span`, the last recorded first; without those of learning (`gather`).
  [[nodiscard]] expected<std::vector<ActionRecord>, StoreError> audit(std::size_t limit,
                                                                      const TimeSpan& span = {});
  /// The last one first.
  [[nodiscard]] expected<std::vector<BaselineRecord>, StoreError> baselines(std::string_view axis,
                                                                            std::size_t limit);
  [[nodiscard]] expected<std::vector<EvidenceRecord>, StoreError> evidence(std::string_view alarm_id);
  /// Names of all files of evidence, also of those that are to be removed.
  [[nodiscard]] expected<std::vector<std::string>, StoreError> evidence_files();
  /// Files that retention gave up: to be removed, then told in Batch::evidence_removed.
  [[nodiscard]] expected<std::vector<std::string>, StoreError> evidence_to_remove(std::size_t limit);
  /// Messages for a target whose time has come, in the order in which they came.
  [[nodiscard]] expected<std::vector<StoredMessage>, StoreError> outbox_due(std::int64_t now_ns,
                                                                            std::size_t limit,
                                                                            std::string_view target);
  /// Those for which messages wait.
  [[nodiscard]] expected<std::vector<std::string>, StoreError> outbox_targets();
  /// UNIX time of the last action of this kind (a name of monitoring::ActionKind).
  [[nodiscard]] expected<std::optional<std::int64_t>, StoreError> newest_action_ns(std::string_view axis,
                                                                                   std::string_view kind);

 private:
  explicit Reader(std::unique_ptr<Impl> impl) noexcept;
  std::unique_ptr<Impl> impl_;
};

}  // namespace resonid::monitor
