// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <chrono>
#include <monitor/store/schema.hpp>

namespace resonid::monitor::detail {
namespace {

constexpr std::int64_t kApplication = 0x52534e4d;  // "RSNM"

// Samples, positions and words of sources are unsigned 64-bit numbers in SQLite's signed ones.
// New rows go to the end of one table, `fresh`, and move to their axis' place in `rows` by the minute: a
// commit of 100 axes writes 6 pages instead of 100. What is there twice meanwhile is read once (Reader).
// An hour is unsettled from the moment that rows of it reach `rows` until its statistics have been made of
// them.
constexpr const char* kSchema = R"(
CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE axes (
  id INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, memory_s REAL NOT NULL DEFAULT 0,
  newest_sample INTEGER NOT NULL DEFAULT -1,
  rows_from INTEGER NOT NULL DEFAULT -9223372036854775808);
CREATE TABLE configurations (hash TEXT PRIMARY KEY, text TEXT NOT NULL, first_time_ns INTEGER NOT NULL);
CREATE TABLE snapshots (
  axis INTEGER NOT NULL, slot INTEGER NOT NULL, sample INTEGER NOT NULL,
  position INTEGER NOT NULL, version TEXT NOT NULL, configuration TEXT NOT NULL, crc INTEGER NOT NULL,
  data BLOB NOT NULL, UNIQUE (axis, slot));
CREATE TABLE fresh (
  id INTEGER PRIMARY KEY, axis INTEGER NOT NULL, time_ns INTEGER NOT NULL, sample INTEGER NOT NULL,
  data BLOB NOT NULL);
CREATE TABLE rows (
  axis INTEGER NOT NULL, time_ns INTEGER NOT NULL, sample INTEGER NOT NULL, data BLOB NOT NULL,
  PRIMARY KEY (axis, time_ns, sample)) WITHOUT ROWID;
CREATE TABLE five_minutes (
  axis INTEGER NOT NULL, start_ns INTEGER NOT NULL, data BLOB NOT NULL, PRIMARY KEY (axis, start_ns)) WITHOUT ROWID;
CREATE TABLE hours (
  axis INTEGER NOT NULL, start_ns INTEGER NOT NULL, data BLOB NOT NULL, PRIMARY KEY (axis, start_ns)) WITHOUT ROWID;
CREATE TABLE days (
  axis INTEGER NOT NULL, start_ns INTEGER NOT NULL, data BLOB NOT NULL, PRIMARY KEY (axis, start_ns)) WITHOUT ROWID;
CREATE TABLE unsettled_hours (
  axis INTEGER NOT NULL, start_ns INTEGER NOT NULL, PRIMARY KEY (axis, start_ns)) WITHOUT ROWID;
CREATE TABLE alarms (
  id TEXT PRIMARY KEY, axis INTEGER NOT NULL, alarm TEXT NOT NULL, sample INTEGER NOT NULL,
  severity INTEGER NOT NULL, active INTEGER NOT NULL, acknowledged INTEGER NOT NULL, latched INTEGER NOT NULL,
  suppressed INTEGER NOT NULL, open INTEGER NOT NULL, shelved_until_ns INTEGER, raised_ns INTEGER NOT NULL,
  cleared_ns INTEGER, json TEXT NOT NULL);
CREATE INDEX alarms_by_time ON alarms (raised_ns);
CREATE INDEX alarms_by_axis ON alarms (axis, raised_ns);
CREATE INDEX alarms_open ON alarms (raised_ns) WHERE open;
CREATE TABLE actions (
  id INTEGER PRIMARY KEY, key TEXT NOT NULL UNIQUE, axis INTEGER NOT NULL, sample INTEGER NOT NULL,
  time_ns INTEGER NOT NULL, kind TEXT NOT NULL, who TEXT NOT NULL, reason TEXT NOT NULL,
  arguments TEXT NOT NULL);
CREATE INDEX actions_of_axis ON actions (axis, sample);
CREATE TABLE baselines (
  id INTEGER PRIMARY KEY, axis INTEGER NOT NULL, sample INTEGER NOT NULL, time_ns INTEGER NOT NULL,
  name TEXT NOT NULL, who TEXT NOT NULL, reason TEXT NOT NULL, figures BLOB NOT NULL, data BLOB NOT NULL,
  UNIQUE (axis, sample, name));
CREATE TABLE evidence (
  file TEXT PRIMARY KEY, alarm_id TEXT NOT NULL, axis INTEGER NOT NULL, from_sample INTEGER NOT NULL,
  to_sample INTEGER NOT NULL, time_ns INTEGER NOT NULL, bytes INTEGER NOT NULL,
  remove INTEGER NOT NULL DEFAULT 0);
CREATE INDEX evidence_of_alarm ON evidence (alarm_id);
CREATE INDEX evidence_by_time ON evidence (time_ns);
CREATE TABLE outbox (
  key TEXT PRIMARY KEY, target TEXT NOT NULL, payload TEXT NOT NULL, created_ns INTEGER NOT NULL,
  tries INTEGER NOT NULL DEFAULT 0, next_ns INTEGER NOT NULL, done_ns INTEGER, text TEXT NOT NULL DEFAULT '');
CREATE INDEX outbox_due ON outbox (next_ns) WHERE done_ns IS NULL;
CREATE INDEX outbox_done ON outbox (done_ns) WHERE done_ns IS NOT NULL;
)";

/// What version 2 has otherwise than version 1: an action may lead to the same event again.
constexpr const char* kVersion2 = R"(
CREATE TABLE positions (
  axis INTEGER PRIMARY KEY, next_sample INTEGER NOT NULL, sender_offset INTEGER NOT NULL, w0 INTEGER NOT NULL,
  w1 INTEGER NOT NULL, w2 INTEGER NOT NULL, w3 INTEGER NOT NULL);
CREATE TABLE events (
  id INTEGER PRIMARY KEY, axis INTEGER NOT NULL, sample INTEGER NOT NULL, alarm TEXT NOT NULL,
  transition TEXT NOT NULL, alarm_id TEXT NOT NULL, time_ns INTEGER NOT NULL, text TEXT NOT NULL,
  json TEXT NOT NULL, action INTEGER NOT NULL, UNIQUE (axis, sample, alarm, transition, action));
CREATE INDEX events_of_alarm ON events (alarm_id);
)";
constexpr const char* kFromVersion1 = R"(
INSERT INTO events SELECT id, axis, sample, alarm, transition, alarm_id, time_ns, text, json, 0 FROM events_1;
DROP TABLE events_1;
)";

constexpr std::string_view kTablesToCheck[] = {
    "meta",         "axes",      "configurations",  "positions", "alarms",
    "events",       "actions",   "baselines",       "evidence",  "outbox",
    "fresh",        "snapshots", "unsettled_hours", "days",      "hours",
    "five_minutes", "rows"};

using QuickClock = std::chrono::steady_clock;
int past_deadline(void* deadline) {
  return QuickClock::now() > *static_cast<const QuickClock::time_point*>(deadline) ? 1 : 0;
}

/// While it lives, statements are interrupted once the deadline has passed.
class Deadline {
 public:
  Deadline(Connection& connection, double limit_s)
      : connection_(connection),
        end_(QuickClock::now() +
             std::chrono::duration_cast<QuickClock::duration>(std::chrono::duration<double>(limit_s))) {
    sqlite3_progress_handler(connection_.handle(), 1000, past_deadline, &end_);
  }
  Deadline(const Deadline&) = delete;
  Deadline& operator=(const Deadline&) = delete;
  ~Deadline() { sqlite3_progress_handler(connection_.handle(), 0, nullptr, nullptr); }
  [[nodiscard]] bool passed() const { return QuickClock::now() > end_; }

 private:
  Connection& connection_;
  QuickClock::time_point end_;
};

/// Makes or renews the tables. What is up to date is not written: a start must not need room on the disk.
void bring_up_to_date(Connection& connection, bool empty) {
  if (!empty && connection.pragma("user_version") == kSchemaVersion) return;
  Transaction transaction(connection, Transaction::Kind::write);
  if (empty) {
    connection.execute(kSchema);
    connection.execute(kVersion2);
    connection.execute(fmt::format("PRAGMA application_id={}", kApplication));
    run(connection, "INSERT INTO meta VALUES ('installation', lower(hex(randomblob(16))))");
  } else {
    connection.execute(
        "ALTER TABLE events RENAME TO events_1; DROP INDEX events_of_alarm; DROP TABLE positions");
    connection.execute(kVersion2);
    connection.execute(kFromVersion1);
  }
  connection.execute(fmt::format("PRAGMA user_version={}", kSchemaVersion));
  transaction.commit();
}

/// Which version wrote last; where the disk is full a later start notes it.
void note_program(Connection& connection, std::string_view version) {
  {
    Query query(connection, "SELECT value FROM meta WHERE key = 'program'");
    if (query.next() && query.bytes(0) == version) return;
  }
  try {
    run(connection, "INSERT INTO meta VALUES ('program', ?) ON CONFLICT DO UPDATE SET value = excluded.value",
        version);
  } catch (const SqliteFailure& failure) {
    if (failure.fault() != StoreFault::full) throw;
  }
}

}  // namespace

void prepare_schema(Connection& connection, const std::string& path, std::string_view program_version) {
  const bool empty = connection.pragma("schema_version") == 0;
  if (empty) {  // before the first table, and outside of transactions
    connection.execute("PRAGMA page_size=4096; PRAGMA auto_vacuum=INCREMENTAL");
  } else if (connection.pragma("application_id") != kApplication) {
    throw SqliteFailure(StoreFault::newer,
                        fmt::format("'{}' is a database of another program; name another file", path));
  } else if (const auto version = connection.pragma("user_version"); version > kSchemaVersion) {
    throw SqliteFailure(StoreFault::newer,
                        fmt::format("'{}' has schema {}, this program knows schemas up to {}; use the later "
                                    "program that wrote it",
                                    path, version, kSchemaVersion));
  }
  if (sqlite3_db_readonly(connection.handle(), "main") == 1)
    throw SqliteFailure(StoreFault::read_only,
                        fmt::format("'{}' is read-only; it must be writable for this user", path));
  connection.execute("PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA wal_autocheckpoint=0");
  // The files of the log stay when the last connection closes: on a full disk they could not be made again.
  int keep = 1;
  sqlite3_file_control(connection.handle(), nullptr, SQLITE_FCNTL_PERSIST_WAL, &keep);
  bring_up_to_date(connection, empty);
  note_program(connection, program_version);
}

void check_quickly(Connection& connection, const std::string& path, double limit_s) {
  const Deadline deadline(connection, limit_s);
  for (const auto table : kTablesToCheck) {
    std::string found;
    try {
      Query query(connection, fmt::format("PRAGMA quick_check('{}')", table));
      if (!query.next() || query.bytes(0) == "ok") continue;
      found = query.text(0);
    } catch (const SqliteFailure&) {
      if (deadline.passed()) return;
      throw;
    }
    throw SqliteFailure(StoreFault::damaged, fmt::format("'{}' is damaged, table {}: {}{}", path, table,
                                                         found, remedy_of_damage(path)));
  }
}

}  // namespace resonid::monitor::detail
