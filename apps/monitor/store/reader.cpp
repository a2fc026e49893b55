// SPDX-License-Identifier: MIT
#include <bit>
#include <cstring>
#include <monitor/store/reader_impl.hpp>
#include <utility>

namespace resonid::monitor {
namespace {

using detail::Query;

std::uint64_t unsigned_of(std::int64_t value) { return static_cast<std::uint64_t>(value); }

std::vector<std::byte> blob(const Query& query, int column) {
  const std::string_view bytes = query.bytes(column);
  std::vector<std::byte> copy(bytes.size());
  if (!bytes.empty()) std::memcpy(copy.data(), bytes.data(), bytes.size());
  return copy;
}

constexpr std::string_view kAlarmColumns =
    "SELECT alarms.id, name, alarm, sample, severity, active, acknowledged, latched, suppressed, open, "
    "shelved_until_ns, raised_ns, cleared_ns, json, "
    "EXISTS (SELECT 1 FROM evidence WHERE alarm_id = alarms.id AND NOT remove) FROM alarms JOIN axes ON "
    "axes.id = axis ";

AlarmRecord alarm_of(const Query& query) {
  AlarmRecord alarm;
  alarm.id = query.text(0);
  alarm.axis = query.text(1);
  alarm.alarm = query.text(2);
  alarm.sample = unsigned_of(query.integer(3));
  alarm.severity = static_cast<int>(query.integer(4));
  alarm.active = query.integer(5) != 0;
  alarm.acknowledged = query.integer(6) != 0;
  alarm.latched = query.integer(7) != 0;
  alarm.suppressed = query.integer(8) != 0;
  alarm.open = query.integer(9) != 0;
  alarm.shelved_until_ns = query.optional_integer(10);
  alarm.raised_ns = query.integer(11);
  alarm.cleared_ns = query.optional_integer(12);
  alarm.json = query.text(13);
  alarm.evidence = query.integer(14) != 0;
  return alarm;
}

constexpr std::string_view kActionColumns =
    "SELECT key, name, sample, time_ns, kind, who, reason, arguments FROM actions JOIN axes ON axes.id = "
    "axis ";

std::vector<ActionRecord> actions_of(Query& query) {
  std::vector<ActionRecord> actions;
  while (query.next())
    actions.push_back({query.text(0), query.text(1), unsigned_of(query.integer(2)), query.integer(3),
                       query.text(4), query.text(5), query.text(6), query.text(7)});
  return actions;
}

constexpr std::string_view kEventColumns =
    "SELECT name, sample, alarm, transition, alarm_id, time_ns, text, json, action FROM events "
    "JOIN axes ON axes.id = axis ";

std::vector<EventRecord> events_of(Query& query) {
  std::vector<EventRecord> events;
  while (query.next())
    events.push_back({query.text(0), unsigned_of(query.integer(1)), query.text(2), query.text(3),
                      query.text(4), query.integer(5), query.text(6), query.text(7),
                      unsigned_of(query.integer(8))});
  return events;
}

std::string_view condition_of(AlarmFilter filter) {
  switch (filter) {
    case AlarmFilter::open:
      return "open ";
    case AlarmFilter::active:
      return "open AND active ";
    case AlarmFilter::unacknowledged:
      return "open AND NOT acknowledged ";
    case AlarmFilter::shelved:
      return "open AND shelved_until_ns IS NOT NULL ";
    case AlarmFilter::cleared:
      return "NOT active ";
    case AlarmFilter::all:
      break;
  }
  return "true ";
}

}  // namespace

std::optional<AxisKey> Reader::Impl::axis(std::string_view name) {
  Query query(connection, "SELECT id, memory_s FROM axes WHERE name = ?", name);
  if (!query.next()) return std::nullopt;
  return AxisKey{query.integer(0), query.real(1)};
}

Reader::Reader(std::unique_ptr<Impl> impl) noexcept : impl_(std::move(impl)) {}
Reader::Reader(Reader&&) noexcept = default;
Reader& Reader::operator=(Reader&&) noexcept = default;
Reader::~Reader() = default;

expected<Reader, StoreError> Reader::open(const std::string& path) {
  return detail::guarded([&] { return Reader(std::make_unique<Impl>(path)); });
}

expected<std::string, StoreError> Reader::installation() {
  return impl_->read([&] {
    Query query(impl_->connection, "SELECT value FROM meta WHERE key = 'installation'");
    return query.next() ? query.text(0) : std::string();
  });
}

expected<std::vector<StoredAxis>, StoreError> Reader::axes() {
  return impl_->read([&] {
    std::vector<StoredAxis> axes;
    Query query(impl_->connection,
                "SELECT name, memory_s, newest_sample FROM axes WHERE name != '' ORDER BY name");
    while (query.next()) {
      StoredAxis axis{query.text(0), query.real(1), {}};
      if (query.integer(2) >= 0) axis.newest_sample = unsigned_of(query.integer(2));
      axes.push_back(std::move(axis));
    }
    return axes;
  });
}

expected<std::optional<StoredConfiguration>, StoreError> Reader::configuration(std::string_view hash) {
  return impl_->read([&]() -> std::optional<StoredConfiguration> {
    Query query(impl_->connection, "SELECT hash, text, first_time_ns FROM configurations WHERE hash = ?",
                hash);
    if (!query.next()) return std::nullopt;
    return StoredConfiguration{query.text(0), query.text(1), query.integer(2)};
  });
}

expected<std::optional<StoredSnapshot>, StoreError> Reader::snapshot(std::string_view axis) {
  return impl_->read([&]() -> std::optional<StoredSnapshot> {
    Query query(impl_->connection,
                "SELECT sample, position, version, configuration, crc, data FROM snapshots "
                "WHERE axis = (SELECT id FROM axes WHERE name = ?) ORDER BY sample DESC",
                axis);
    bool previous = false;
    while (query.next()) {
      if (detail::crc_of(query.bytes(5)) == query.integer(4))
        return StoredSnapshot{{std::string(axis), unsigned_of(query.integer(0)),
                               unsigned_of(query.integer(1)), query.text(2), query.text(3), blob(query, 5)},
                              previous};
      previous = true;
    }
    return std::nullopt;
  });
}

expected<std::optional<PositionRecord>, StoreError> Reader::position(std::string_view axis) {
  return impl_->read([&]() -> std::optional<PositionRecord> {
    Query query(impl_->connection,
                "SELECT next_sample, sender_offset, w0, w1, w2, w3 FROM positions "
                "WHERE axis = (SELECT id FROM axes WHERE name = ?)",
                axis);
    if (!query.next()) return std::nullopt;
    PositionRecord position{
        std::string(axis), unsigned_of(query.integer(0)), unsigned_of(query.integer(1)), {}};
    for (int i = 0; i < 4; ++i)
      position.word[static_cast<std::size_t>(i)] = unsigned_of(query.integer(2 + i));
    return position;
  });
}

expected<std::vector<ActionRecord>, StoreError> Reader::actions(std::string_view axis,
                                                                std::uint64_t from_sample,
                                                                std::size_t limit) {
  return impl_->read([&] {
    if (from_sample > unsigned_of(std::numeric_limits<std::int64_t>::max()))
      return std::vector<ActionRecord>{};
    Query query(
        impl_->connection,
        std::string(kActionColumns) +
            "WHERE axis = (SELECT id FROM axes WHERE name = ?) AND sample >= ? ORDER BY sample, actions.id "
            "LIMIT ?",
        axis, from_sample, sql_limit(limit));
    return actions_of(query);
  });
}

expected<std::optional<ActionRecord>, StoreError> Reader::newest_action(std::string_view axis) {
  return impl_->read([&]() -> std::optional<ActionRecord> {
    Query query(impl_->connection,
                std::string(kActionColumns) +
                    "WHERE actions.id = (SELECT max(id) FROM actions WHERE axis = (SELECT id FROM axes WHERE "
                    "name = ?))",
                axis);
    auto found = actions_of(query);
    if (found.empty()) return std::nullopt;
    return std::move(found.front());
  });
}

expected<std::vector<RowRecord>, StoreError> Reader::rows(std::string_view axis, std::int64_t from_ns,
                                                          std::int64_t to_ns, std::size_t limit) {
  return impl_->read([&] {
    std::vector<RowRecord> rows;
    const auto key = impl_->axis(axis);
    if (!key || limit == 0) return rows;
    impl_->visit_rows(key->id, from_ns, to_ns,
                      [&](std::int64_t time_ns, std::uint64_t sample, const RowBytes& row) {
                        rows.push_back({std::string(axis), time_ns, row.row(sample)});
                        return rows.size() < limit;
                      });
    return rows;
  });
}

expected<std::vector<AlarmRecord>, StoreError> Reader::alarms(AlarmFilter filter,
                                                              const std::optional<std::string>& axis,
                                                              std::size_t limit, const TimeSpan& span) {
  return impl_->read([&] {
    std::string sql(kAlarmColumns);
    sql += "WHERE ";
    sql += condition_of(filter);
    sql += axis ? "AND axis = (SELECT id FROM axes WHERE name = ?2) " : "AND ?2 = '' ";
    // What ended it, a person mostly, is its last event.
    sql +=
        "AND raised_ns < ?4 AND (open OR raised_ns >= ?3 OR cleared_ns >= ?3 OR "
        "EXISTS (SELECT 1 FROM events WHERE alarm_id = alarms.id AND time_ns >= ?3)) "
        "ORDER BY raised_ns DESC LIMIT ?1";
    std::vector<AlarmRecord> alarms;
    Query query(impl_->connection, sql, sql_limit(limit), axis.value_or(""), span.from_ns, span.to_ns);
    while (query.next()) alarms.push_back(alarm_of(query));
    return alarms;
  });
}

expected<std::map<int, std::uint64_t>, StoreError> Reader::active_alarms(std::span<const AlarmRecord> newer) {
  return impl_->read([&] {
    const std::string sql = "FROM alarms WHERE " + std::string(condition_of(AlarmFilter::active));
    std::map<int, std::uint64_t> counts;
    Query query(impl_->connection, "SELECT severity, count(*) " + sql + "GROUP BY severity");
    while (query.next()) counts[static_cast<int>(query.integer(0))] = unsigned_of(query.integer(1));
    for (const auto& alarm : newer) {
      Query known(impl_->connection, "SELECT severity " + sql + "AND id = ?", alarm.id);
      if (known.next()) --counts[static_cast<int>(known.integer(0))];
      if (alarm.open && alarm.active) ++counts[alarm.severity];
    }
    return counts;
  });
}

expected<std::optional<AlarmRecord>, StoreError> Reader::alarm(std::string_view id) {
  return impl_->read([&]() -> std::optional<AlarmRecord> {
    Query query(impl_->connection, std::string(kAlarmColumns) + "WHERE alarms.id = ?", id);
    if (!query.next()) return std::nullopt;
    return alarm_of(query);
  });
}

expected<std::vector<EventRecord>, StoreError> Reader::events(std::string_view alarm_id, std::size_t limit) {
  return impl_->read([&] {
    Query query(impl_->connection,
                std::string(kEventColumns) + "WHERE alarm_id = ? ORDER BY events.id LIMIT ?", alarm_id,
                sql_limit(limit));
    return events_of(query);
  });
}

expected<std::vector<EventRecord>, StoreError> Reader::events_from(std::string_view axis,
                                                                   std::uint64_t sample, std::size_t limit) {
  return impl_->read([&] {
    if (sample > unsigned_of(std::numeric_limits<std::int64_t>::max())) return std::vector<EventRecord>{};
    Query query(impl_->connection,
                std::string(kEventColumns) +
                    "WHERE axis = (SELECT id FROM axes WHERE name = ?) AND sample >= ? ORDER BY events.id "
                    "LIMIT ?",
                axis, sample, sql_limit(limit));
    return events_of(query);
  });
}

expected<std::vector<ActionRecord>, StoreError> Reader::audit(std::size_t limit, const TimeSpan& span) {
  return impl_->read([&] {
    Query query(
        impl_->connection,
        std::string(kActionColumns) +
            "WHERE kind <> 'gather' AND time_ns >= ? AND time_ns < ? ORDER BY actions.id DESC LIMIT ?",
        span.from_ns, span.to_ns, sql_limit(limit));
    return actions_of(query);
  });
}

expected<std::vector<BaselineRecord>, StoreError> Reader::baselines(std::string_view axis,
                                                                    std::size_t limit) {
  return impl_->read([&] {
    std::vector<BaselineRecord> baselines;
    Query query(impl_->connection,
                "SELECT sample, time_ns, name, who, reason, figures, data FROM baselines "
                "WHERE axis = (SELECT id FROM axes WHERE name = ?) ORDER BY id DESC LIMIT ?",
                axis, sql_limit(limit));
    while (query.next()) {
      const auto figures = RowBytes::of(query.bytes(5));
      if (!figures) continue;
      const auto sample = unsigned_of(query.integer(0));
      baselines.push_back({std::string(axis), sample, query.integer(1), query.text(2), query.text(3),
                           query.text(4), figures->row(sample), blob(query, 6)});
    }
    return baselines;
  });
}

expected<std::vector<EvidenceRecord>, StoreError> Reader::evidence(std::string_view alarm_id) {
  return impl_->read([&] {
    std::vector<EvidenceRecord> evidence;
    Query query(impl_->connection,
                "SELECT file, alarm_id, name, from_sample, to_sample, time_ns, bytes FROM evidence "
                "JOIN axes ON axes.id = axis WHERE alarm_id = ? AND NOT remove ORDER BY time_ns",
                alarm_id);
    while (query.next())
      evidence.push_back({query.text(0), query.text(1), query.text(2), unsigned_of(query.integer(3)),
                          unsigned_of(query.integer(4)), query.integer(5), unsigned_of(query.integer(6))});
    return evidence;
  });
}

expected<std::vector<std::string>, StoreError> Reader::evidence_files() {
  return impl_->read([&] {
    std::vector<std::string> files;
    Query query(impl_->connection, "SELECT file FROM evidence");
    while (query.next()) files.push_back(query.text(0));
    return files;
  });
}

expected<std::vector<std::string>, StoreError> Reader::evidence_to_remove(std::size_t limit) {
  return impl_->read([&] {
    std::vector<std::string> files;
    Query query(impl_->connection, "SELECT file FROM evidence WHERE remove LIMIT ?", sql_limit(limit));
    while (query.next()) files.push_back(query.text(0));
    return files;
  });
}

expected<std::vector<StoredMessage>, StoreError> Reader::outbox_due(std::int64_t now_ns, std::size_t limit,
                                                                    std::string_view target) {
  return impl_->read([&] {
    std::vector<StoredMessage> due;
    Query query(impl_->connection,
                "SELECT key, target, payload, created_ns, tries, text FROM outbox "
                "WHERE done_ns IS NULL AND next_ns <= ? AND target = ? ORDER BY rowid LIMIT ?",
                now_ns, target, sql_limit(limit));
    while (query.next())
      due.push_back({{query.text(0), query.text(1), query.text(2), query.integer(3)},
                     unsigned_of(query.integer(4)),
                     query.text(5)});
    return due;
  });
}

expected<std::vector<std::string>, StoreError> Reader::outbox_targets() {
  return impl_->read([&] {
    std::vector<std::string> targets;
    Query query(impl_->connection, "SELECT DISTINCT target FROM outbox WHERE done_ns IS NULL");
    while (query.next()) targets.push_back(query.text(0));
    return targets;
  });
}

expected<std::optional<std::int64_t>, StoreError> Reader::newest_action_ns(std::string_view axis,
                                                                           std::string_view kind) {
  return impl_->read([&] {
    Query query(impl_->connection,
                "SELECT max(time_ns) FROM actions "
                "WHERE axis = (SELECT id FROM axes WHERE name = ?) AND kind = ?",
                axis, kind);
    return query.next() ? query.optional_integer(0) : std::nullopt;
  });
}

}  // namespace resonid::monitor
