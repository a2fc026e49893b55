// SPDX-License-Identifier: MIT
#include <sqlite3.h>

#include <atomic>
#include <thread>

#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

std::vector<std::byte> bytes_of(std::string_view text) {
  std::vector<std::byte> bytes(text.size());
  std::memcpy(bytes.data(), text.data(), text.size());
  return bytes;
}

/// Changes the file as another program would.
void execute_in(const std::string& file, const char* sql) {
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(handle, sql, nullptr, nullptr, nullptr), SQLITE_OK) << sqlite3_errmsg(handle);
  sqlite3_close(handle);
}

TEST(Store, RowsComeBackBitForBitAfterBothPlacesAndARestart) {
  const Folder folder;
  std::mt19937_64 random(5);
  std::vector<RowRecord> rows;
  for (std::uint64_t i = 0; i < 500; ++i) {
    auto row = any_row(random);
    row.sample = 1000 * i;
    rows.push_back(record_of("x", kStart + static_cast<std::int64_t>(i) * kSecond, row));
  }
  const auto all_there = [&] {
    auto reader = reader_of(folder.file());
    const auto read = value(reader.rows("x", kStart, kStart + kHour, 1000));
    ASSERT_EQ(read.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(read[i].time_ns, rows[i].time_ns);
      ASSERT_TRUE(same_bits(read[i].row, rows[i].row)) << i;
    }
  };
  {
    Store store = opened(folder.file());
    Batch batch;
    batch.rows = rows;
    EXPECT_EQ(value(store.commit(batch)).rows, 500U);
    all_there();
    keep_up(store, kStart + 600 * kSecond);
    all_there();
    const auto again = value(store.commit(batch));
    EXPECT_EQ(again.rows, 0U);
    EXPECT_EQ(again.known_rows, 500U);
  }
  Store store = opened(folder.file());
  Batch batch;
  batch.rows = rows;
  EXPECT_EQ(value(store.commit(batch)).known_rows, 500U);
  keep_up(store, kStart + 2 * kHour);
  all_there();
  auto reader = reader_of(folder.file());
  const auto axes = value(reader.axes());
  ASSERT_EQ(axes.size(), 1U);
  EXPECT_EQ(axes[0].newest_sample, 499'000U);
}

TEST(Store, NewestSnapshotOrThePreviousWhereItIsDamaged) {
  const Folder folder;
  Store store = opened(folder.file());
  for (std::uint64_t i = 1; i <= 3; ++i) {
    Batch batch;
    batch.snapshots.push_back(
        {"x", 100 * i, 90 * i, "1.2", "abc", std::vector<std::byte>(5000, static_cast<std::byte>(i))});
    value(store.commit(batch));
    value(store.commit(batch));  // again: must not push the previous one out
  }
  auto reader = reader_of(folder.file());
  auto found = value(reader.snapshot("x"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->snapshot.sample, 300U);
  EXPECT_EQ(found->snapshot.position, 270U);
  EXPECT_EQ(found->snapshot.version, "1.2");
  EXPECT_EQ(found->snapshot.configuration_hash, "abc");
  EXPECT_EQ(found->snapshot.bytes, std::vector<std::byte>(5000, std::byte{3}));
  EXPECT_FALSE(found->previous);

  execute_in(folder.file(), "UPDATE snapshots SET data = zeroblob(5000) WHERE sample = 300");
  found = value(reader.snapshot("x"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->snapshot.sample, 200U);
  EXPECT_TRUE(found->previous);

  Batch batch;  // the replay from there makes another one, at a sample before the damaged one's
  batch.snapshots.push_back({"x", 250, 240, "1.2", "abc", bytes_of("new")});
  value(store.commit(batch));
  found = value(reader.snapshot("x"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->snapshot.sample, 250U);
  execute_in(folder.file(), "UPDATE snapshots SET crc = crc + 1");
  EXPECT_FALSE(value(reader.snapshot("x")));
  EXPECT_FALSE(value(reader.snapshot("unknown")));
}

/// An axis that begins anew does so at the oldest sample of its ring.
TEST(Store, SnapshotsOfAnotherConfigurationOrVersionGiveWayToOlderSamples) {
  const Folder folder;
  Store store = opened(folder.file());
  auto reader = reader_of(folder.file());
  const auto put = [&](std::uint64_t sample, const char* version, const char* configuration) {
    Batch batch;
    batch.snapshots.push_back({"x", sample, sample, version, configuration, bytes_of("state")});
    value(store.commit(batch));
    return value(reader.snapshot("x"))->snapshot;
  };
  put(900, "1", "abc");
  put(1000, "1", "abc");
  EXPECT_EQ(put(200, "1", "def").sample, 200U);
  EXPECT_EQ(put(300, "1", "def").configuration_hash, "def");
  EXPECT_EQ(put(250, "1", "def").sample, 300U);  // a replay
  EXPECT_EQ(put(100, "2", "def").version, "2");
}

TEST(Store, ConfigurationsByHashWithTheirFirstUse) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.configurations = {{"abc", 5 * kSecond}, {"abc", 9 * kSecond}};
  value(store.commit(batch));
  // FIPS 180-2, B.1
  constexpr auto kHash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
  EXPECT_EQ(configuration_hash("abc"), kHash);
  auto reader = reader_of(folder.file());
  const auto found = value(reader.configuration(kHash));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->text, "abc");
  EXPECT_EQ(found->first_time_ns, 5 * kSecond);
  EXPECT_FALSE(value(reader.configuration("00")));
}

TEST(Store, PositionsOfSourcesKeepAllTheirBits) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.positions = {{"a", 5, 1, {1, 2, 3, 4}}, {"a", ~0ULL, 1ULL << 63U, {~0ULL, 1ULL << 63U, 0, 7}}};
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  const auto found = value(reader.position("a"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->next_sample, ~0ULL);
  EXPECT_EQ(found->sender_offset, 1ULL << 63U);
  EXPECT_EQ(found->word, (std::array<std::uint64_t, 4>{~0ULL, 1ULL << 63U, 0, 7}));
  EXPECT_FALSE(value(reader.position("other")));
}

AlarmRecord raised(std::string id, std::uint64_t sample, std::int64_t raised_ns) {
  AlarmRecord alarm;
  alarm.id = std::move(id);
  alarm.axis = "x";
  alarm.alarm = "stiffness";
  alarm.sample = sample;
  alarm.severity = 700;
  alarm.active = true;
  alarm.raised_ns = raised_ns;
  alarm.json = "{}";
  return alarm;
}

TEST(Store, AlarmsFollowTheirStateAndNeverGoBack) {
  const Folder folder;
  Store store = opened(folder.file());
  AlarmRecord alarm = raised("x.stiffness.10", 10, kStart);
  AlarmRecord cleared = alarm;
  cleared.sample = 50;
  cleared.active = false;
  cleared.cleared_ns = kStart + 5;
  cleared.shelved_until_ns = kStart + 9;
  Batch batch;
  batch.alarms = {alarm, cleared, alarm, raised("x.stiffness.70", 70, kStart + 7)};
  batch.alarms[3].acknowledged = true;
  batch.alarms.push_back(raised("done", 5, kStart - 7));
  batch.alarms.back().open = false;
  batch.alarms.back().axis = "";
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  const auto found = value(reader.alarm("x.stiffness.10"));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sample, 50U);
  EXPECT_FALSE(found->active);
  EXPECT_EQ(found->cleared_ns, kStart + 5);
  EXPECT_EQ(found->raised_ns, kStart);
  const auto ids = [&](AlarmFilter filter, const std::optional<std::string>& axis = {}) {
    std::string all;
    for (const auto& one : value(reader.alarms(filter, axis, 10))) all += one.id + " ";
    return all;
  };
  EXPECT_EQ(ids(AlarmFilter::all), "x.stiffness.70 x.stiffness.10 done ");
  EXPECT_EQ(ids(AlarmFilter::open), "x.stiffness.70 x.stiffness.10 ");
  EXPECT_EQ(ids(AlarmFilter::active), "x.stiffness.70 ");
  EXPECT_EQ(ids(AlarmFilter::unacknowledged), "x.stiffness.10 ");
  EXPECT_EQ(ids(AlarmFilter::shelved), "x.stiffness.10 ");
  EXPECT_EQ(ids(AlarmFilter::all, "x"), "x.stiffness.70 x.stiffness.10 ");
  EXPECT_EQ(ids(AlarmFilter::all, "y"), "");
  EXPECT_EQ(ids(AlarmFilter::all, ""), "done ");
}

TEST(Store, EventsAreWrittenOnceByTheirKey) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.events = {{"x", 10, "stiffness", "raise", "a1", kStart, "fell by 5 %", "{\"n\":1}"},
                  {"x", 10, "stiffness", "latch", "a1", kStart, "latched", "{}"},
                  {"x", 10, "resonance", "raise", "a2", kStart, "another alarm", "{}"},
                  {"x", 20, "stiffness", "raise", "a1", kStart, "again", "{}"},
                  {"x", 20, "stale", "realarmed", "a3", kStart, "silent", "{}", 7},
                  {"x", 20, "stale", "realarmed", "a3", kStart + kSecond, "still silent", "{}", 8}};
  EXPECT_EQ(value(store.commit(batch)).events, 6U);
  EXPECT_EQ(value(store.commit(batch)).known_events, 6U);
  auto reader = reader_of(folder.file());
  const auto events = value(reader.events("a1", 10));
  ASSERT_EQ(events.size(), 3U);
  EXPECT_EQ(events[0].text, "fell by 5 %");
  EXPECT_EQ(events[0].json, "{\"n\":1}");
  EXPECT_EQ(events[1].transition, "latch");
  EXPECT_EQ(events[2].sample, 20U);
  EXPECT_EQ(value(reader.events("a1", 1)).size(), 1U);
  const auto reminders = value(reader.events("a3", 10));
  ASSERT_EQ(reminders.size(), 2U);
  EXPECT_EQ(reminders[1].action, 8U);
}

TEST(Store, BringsADatabaseOfTheFirstVersionUpToDate) {
  const Folder folder;
  Batch batch;
  batch.events = {{"x", 10, "stiffness", "raise", "a1", kStart, "fell by 5 %", "{}"}};
  {
    Store store = opened(folder.file());
    value(store.commit(batch));
  }
  execute_in(folder.file(), R"(
    ALTER TABLE events RENAME TO later; DROP INDEX events_of_alarm; DROP TABLE positions;
    CREATE TABLE positions (source TEXT PRIMARY KEY, w0 INTEGER, w1 INTEGER, w2 INTEGER, w3 INTEGER) WITHOUT ROWID;
    CREATE TABLE events (
      id INTEGER PRIMARY KEY, axis INTEGER NOT NULL, sample INTEGER NOT NULL, alarm TEXT NOT NULL,
      transition TEXT NOT NULL, alarm_id TEXT NOT NULL, time_ns INTEGER NOT NULL, text TEXT NOT NULL,
      json TEXT NOT NULL, UNIQUE (axis, sample, alarm, transition));
    INSERT INTO events SELECT id, axis, sample, alarm, transition, alarm_id, time_ns, text, json FROM later;
    DROP TABLE later; CREATE INDEX events_of_alarm ON events (alarm_id); PRAGMA user_version=1)");
  Store store = opened(folder.file());
  EXPECT_EQ(value(store.commit(batch)).known_events, 1U);
  batch.events[0].action = 3;
  batch.positions = {{"x", 11, 0, {1, 2, 3, 4}}};
  EXPECT_EQ(value(store.commit(batch)).events, 1U);
  auto reader = reader_of(folder.file());
  EXPECT_EQ(value(reader.events("a1", 10)).size(), 2U);
  EXPECT_EQ(value(reader.position("x"))->next_sample, 11U);
}

TEST(Store, ReplayReadsActionsInTheOrderInWhichTheyAct) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.actions = {{"k1", "x", 500, kStart, "acknowledge", "ann", "seen", "{\"alarm\":\"a1\"}"},
                   {"k2", "x", 100, kStart + 1, "relearn", "bob", "new belt", "{}"},
                   {"k3", "x", 500, kStart + 2, "reset", "ann", "", "{}"},
                   {"k4", "y", 300, kStart + 3, "baseline", "bob", "good", "{}"}};
  EXPECT_EQ(value(store.commit(batch)).actions, 4U);
  EXPECT_EQ(value(store.commit(batch)).actions, 0U);
  auto reader = reader_of(folder.file());
  const auto actions = value(reader.actions("x", 100, 10));
  ASSERT_EQ(actions.size(), 3U);
  EXPECT_EQ(actions[0].key, "k2");
  EXPECT_EQ(actions[1].key, "k1");
  EXPECT_EQ(actions[1].who, "ann");
  EXPECT_EQ(actions[1].reason, "seen");
  EXPECT_EQ(actions[1].arguments, "{\"alarm\":\"a1\"}");
  EXPECT_EQ(actions[2].key, "k3");
  EXPECT_EQ(value(reader.actions("x", 101, 10)).size(), 2U);
  EXPECT_EQ(value(reader.newest_action("x"))->key, "k3");
  EXPECT_EQ(value(reader.newest_action("y"))->key, "k4");
  EXPECT_FALSE(value(reader.newest_action("z")));
  EXPECT_EQ(value(reader.newest_action_ns("x", "relearn")), kStart + 1);
  EXPECT_FALSE(value(reader.newest_action_ns("y", "relearn")));
  const auto audit = value(reader.audit(2));
  ASSERT_EQ(audit.size(), 2U);
  EXPECT_EQ(audit[0].key, "k4");
  EXPECT_EQ(audit[1].key, "k3");
}

TEST(Store, BaselinesWithTheirFiguresAndResponse) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.baselines = {
      {"x", 40, kStart, "commissioning", "ann", "signed off", some_row(40, 61.5), bytes_of("response")},
      {"x", 90, kStart + 1, "belt", "bob", "", some_row(90, 62.0), {}}};
  value(store.commit(batch));
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  const auto baselines = value(reader.baselines("x", 10));
  ASSERT_EQ(baselines.size(), 2U);
  EXPECT_EQ(baselines[0].name, "belt");
  EXPECT_EQ(baselines[1].who, "ann");
  EXPECT_TRUE(same_bits(baselines[1].figures, some_row(40, 61.5)));
  EXPECT_EQ(baselines[1].bytes, bytes_of("response"));
}

TEST(Store, EvidenceThatIsCompletedIsOneFile) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.evidence = {{"1.csv", "1", "x", 10, 20, kStart, 300}};
  value(store.commit(batch));
  batch.evidence = {{"1.csv", "1", "x", 10, 60, kStart + 1, 1500}};
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  auto evidence = value(reader.evidence("1"));
  ASSERT_EQ(evidence.size(), 1U);
  EXPECT_EQ(evidence[0].to_sample, 60U);
  EXPECT_EQ(evidence[0].bytes, 1500U);
  EXPECT_EQ(evidence[0].time_ns, kStart);  // it is as old as before
  Batch report;
  report.evidence_sizes = {{"1.csv", 2500}};
  value(store.commit(report));
  evidence = value(reader.evidence("1"));
  EXPECT_EQ(evidence[0].bytes, 2500U);
}

TEST(Store, OutboxGivesEachMessageUntilItIsDelivered) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.outbox = {{"x/10/raise", "webhook", "{1}", kStart}, {"x/20/clear", "mqtt", "{2}", kStart + 5}};
  value(store.commit(batch));
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  EXPECT_TRUE(value(reader.outbox_due(kStart - 1, 10, "webhook")).empty());
  EXPECT_EQ(value(reader.outbox_due(kStart + 5, 10, "mqtt")).size(), 1U);
  auto due = value(reader.outbox_due(kStart + 5, 10, "webhook"));
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].message.key, "x/10/raise");
  EXPECT_EQ(due[0].message.payload, "{1}");

  Batch failed;
  failed.deliveries = {{"x/10/raise", kStart + 6, kStart + kSecond, "refused"},
                       {"x/20/clear", kStart + 6, {}, ""}};
  value(store.commit(failed));
  value(store.commit(failed));  // said twice, tried once
  EXPECT_TRUE(value(reader.outbox_due(kStart + kSecond, 10, "mqtt")).empty());
  EXPECT_TRUE(value(reader.outbox_due(kStart + kSecond - 1, 10, "webhook")).empty());
  due = value(reader.outbox_due(kStart + kSecond, 10, "webhook"));
  ASSERT_EQ(due.size(), 1U);
  EXPECT_EQ(due[0].tries, 1U);
  EXPECT_EQ(due[0].text, "refused");

  Batch delivered;
  delivered.deliveries = {{"x/10/raise", kStart + 2 * kSecond, {}, ""}};
  value(store.commit(delivered));
  value(store.commit(batch));  // the replay raises the same alarm: not sent again
  EXPECT_TRUE(value(reader.outbox_due(kStart + kHour, 10, "webhook")).empty());
}

TEST(Store, TheOutboxGivesUpAllThatWaitsForATarget) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.outbox = {{"mqtt/1", "mqtt", "{1}", kStart},
                  {"nats/1", "nats", "{1}", kStart},
                  {"mqtt/2", "mqtt", "{2}", kStart},
                  {"mqtt", "webhook", "{1}", kStart}};  // a key, not the target
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  EXPECT_EQ(value(reader.outbox_targets()).size(), 3U);
  ASSERT_EQ(value(reader.outbox_due(kStart, 10, "nats")).size(), 1U);
  EXPECT_EQ(value(reader.outbox_due(kStart, 10, "nats"))[0].message.key, "nats/1");
  EXPECT_EQ(value(reader.outbox_due(kStart, 1, "mqtt"))[0].message.key, "mqtt/1");
  Batch given_up;
  given_up.deliveries = {{"mqtt", kStart + 1, {}, "given up", true}};
  value(store.commit(given_up));
  EXPECT_TRUE(value(reader.outbox_due(kStart, 10, "mqtt")).empty());
  EXPECT_EQ(value(reader.outbox_due(kStart, 10, "nats")).size(), 1U);
  EXPECT_EQ(value(reader.outbox_due(kStart, 10, "webhook")).size(), 1U);
  EXPECT_EQ(value(reader.outbox_targets()).size(), 2U);
}

TEST(Store, KeepsItsInstallation) {
  const Folder folder;
  std::string first;
  {
    Store store = opened(folder.file());
    first = value(reader_of(folder.file()).installation());
  }
  EXPECT_EQ(first.size(), 32U);
  Store store = opened(folder.file());
  EXPECT_EQ(value(reader_of(folder.file()).installation()), first);
}

TEST(Store, OddRecordsAreCountedAndTheRestIsWritten) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.axes = {{"x", std::nan("")}};
  batch.rows = {record_of("x", kStart, some_row(1ULL << 63U)),
                record_of("x", std::numeric_limits<std::int64_t>::min(), some_row(1)),
                record_of("x", kStart, some_row(2))};
  batch.rows.push_back(record_of(std::string("\0'; DROP TABLE rows; \xff", 23), kStart, some_row(1)));
  batch.events = {{"x", ~0ULL, "a", "b", "c", 0, "", ""}};
  const auto done = value(store.commit(batch));
  EXPECT_EQ(done.rows, 2U);
  EXPECT_EQ(done.refused, 3U);
  keep_up(store, kStart + 3 * kHour);
  auto reader = reader_of(folder.file());
  EXPECT_EQ(value(reader.rows(batch.rows[3].axis, kStart, kStart + 1, 10)).size(), 1U);
}

TEST(Store, ReadersSeeWholeCommitsWhileTheWriterGoesOn) {
  const Folder folder;
  Store store = opened(folder.file());
  std::atomic<bool> stop = false;
  std::atomic<int> torn = 0, reads = 0;
  Batch first;
  first.rows = {record_of("x", kStart, some_row(0)), record_of("y", kStart, some_row(0))};
  value(store.commit(first));
  std::vector<std::thread> threads;
  for (int i = 0; i < 3; ++i)
    threads.emplace_back([&] {
      auto reader = reader_of(folder.file());
      while (!stop) {
        const auto axes = reader.axes();
        if (!axes || axes->size() != 2 || (*axes)[0].newest_sample != (*axes)[1].newest_sample) ++torn;
        ++reads;
      }
    });
  for (std::uint64_t i = 1; i < 200; ++i) {
    Batch batch;
    const auto time = kStart + static_cast<std::int64_t>(i) * kSecond;
    batch.rows = {record_of("x", time, some_row(i)), record_of("y", time, some_row(i))};
    value(store.commit(batch));
    value(store.upkeep(time));
  }
  stop = true;
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(torn, 0);
  EXPECT_GT(reads, 0);
}

}  // namespace
}  // namespace resonid::monitor::test
