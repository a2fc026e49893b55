// SPDX-License-Identifier: MIT
#include <sqlite3.h>

#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

using monitoring::Watched;

constexpr std::int64_t kDay = 24 * kHour;

std::int64_t count_in(const std::string& file, const std::string& sql) {
  sqlite3* handle = nullptr;
  EXPECT_EQ(sqlite3_open(file.c_str(), &handle), SQLITE_OK);
  std::int64_t count = -1;
  EXPECT_EQ(sqlite3_exec(
                handle, sql.c_str(),
                [](void* out, int, char** text, char**) {
                  *static_cast<std::int64_t*>(out) = text[0] != nullptr ? std::atoll(text[0]) : -1;
                  return 0;
                },
                &count, nullptr),
            SQLITE_OK);
  sqlite3_close(handle);
  return count;
}

/// Rows each `step_s` from the start on, as a machine delivers them: with upkeep in between.
void run_machine(Store& store, const std::vector<std::string>& axes, std::int64_t from_ns, std::int64_t to_ns,
                 std::int64_t step_ns) {
  Batch batch;
  for (std::int64_t time = from_ns; time < to_ns; time += step_ns) {
    const auto sample = static_cast<std::uint64_t>((time - kStart) / kSecond);
    for (const auto& axis : axes)
      batch.rows.push_back(
          record_of(axis, time, some_row(sample, 50.0 + 1e-5 * static_cast<double>(sample))));
    if (batch.rows.size() < 2000) continue;
    value(store.commit(batch));
    batch = {};
    keep_up(store, time);
  }
  value(store.commit(batch));
  keep_up(store, to_ns);
}

TEST(Upkeep, HoursAndDaysAreThoseOfTheRows) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  batch.axes = {{"x", 20.0}};
  value(store.commit(batch));
  run_machine(store, {"x"}, kStart + kHour / 2, kStart + 26 * kHour, kSecond);
  keep_up(store, kStart + 26 * kHour + 180 * kSecond);
  auto reader = reader_of(folder.file());
  const auto hours =
      value(reader.history({"x", {Watched::resonance}, kStart, kStart + 2 * kDay, 100, Resolution::hour}));
  ASSERT_EQ(hours.time_ns.size(), 26U);
  FigureGatherer first, second;
  for (int i = 1800; i < 7200; ++i)
    (i < 3600 ? first : second)
        .add(kStart + i * kSecond, some_row(0, 50.0 + 1e-5 * i)[Watched::resonance], true);
  EXPECT_EQ(hours.figures[0][0].trusted, 1800U);
  EXPECT_DOUBLE_EQ(hours.figures[0][0].mean, first.summary(20.0).mean);
  EXPECT_DOUBLE_EQ(hours.figures[0][0].std, first.summary(20.0).std);
  EXPECT_EQ(hours.figures[0][1].trusted, 3600U);
  EXPECT_DOUBLE_EQ(hours.figures[0][1].std, second.summary(20.0).std);
  EXPECT_DOUBLE_EQ(hours.figures[0][1].max, 50.0 + 1e-5 * 7199);
  const auto days =
      value(reader.history({"x", {Watched::resonance}, kStart, kStart + 2 * kDay, 100, Resolution::day}));
  ASSERT_EQ(days.time_ns.size(), 2U);
  EXPECT_EQ(days.figures[0][0].rows, 86400U - 1800U);
  EXPECT_NEAR(days.figures[0][0].mean, 50.0 + 1e-5 * (1800 + 86399) / 2.0, 1e-9);
  EXPECT_EQ(days.figures[0][1].rows, 7200U);
}

TEST(Upkeep, LateRowsAreCountedIntoTheirHour) {
  const Folder folder;
  Store store = opened(folder.file());
  run_machine(store, {"x"}, kStart, kStart + 1800 * kSecond, kSecond);
  keep_up(store, kStart + 3 * kHour);
  run_machine(store, {"x"}, kStart + 1800 * kSecond, kStart + 3600 * kSecond,
              kSecond);  // a source that replays
  keep_up(store, kStart + 4 * kHour);
  keep_up(store, kStart + 4 * kHour + 60 * kSecond);
  auto reader = reader_of(folder.file());
  const auto hours =
      value(reader.history({"x", {Watched::resonance}, kStart, kStart + kDay, 100, Resolution::hour}));
  ASSERT_EQ(hours.time_ns.size(), 1U);
  EXPECT_EQ(hours.figures[0][0].rows, 3600U);
}

TEST(Upkeep, AKillBetweenTheStepsOfAMoveLosesNothing) {
  const Folder folder;
  const std::vector<std::string> axes = {"a", "b", "c", "d", "e", "f", "g", "h"};
  Batch batch;
  for (int i = 0; i < 600; ++i)
    for (const auto& axis : axes)
      batch.rows.push_back(record_of(axis, kStart + i * kSecond, some_row(static_cast<std::uint64_t>(i))));
  {
    Store store = opened(folder.file());
    value(store.commit(batch));
    value(store.upkeep(kStart + kHour / 2));
    EXPECT_TRUE(value(store.upkeep(kStart + kHour / 2)).more);
  }
  EXPECT_GT(count_in(folder.file(), "SELECT count(*) FROM rows"), 0);
  EXPECT_EQ(count_in(folder.file(), "SELECT count(*) FROM fresh"), 4800);  // the move is not at its end
  Store store = opened(folder.file());
  auto reader = reader_of(folder.file());
  for (const auto& axis : axes)
    EXPECT_EQ(value(reader.rows(axis, kStart, kStart + kHour, 9999)).size(), 600U);
  keep_up(store, kStart + kHour / 2);
  keep_up(store, kStart + kHour);
  for (const auto& axis : axes)
    EXPECT_EQ(value(reader.rows(axis, kStart, kStart + kHour, 9999)).size(), 600U);
  EXPECT_EQ(count_in(folder.file(), "SELECT count(*) FROM rows"), 4800);
  EXPECT_EQ(count_in(folder.file(), "SELECT count(*) FROM fresh"), 0);
}

TEST(Upkeep, RowsGoByAgeTheirHoursStay) {
  const Folder folder;
  StoreOptions options;
  options.retention.rows_s = 86400;
  Store store = opened(folder.file(), options);
  run_machine(store, {"x", "y"}, kStart, kStart + 3 * kDay, 10 * kSecond);
  keep_up(store, kStart + 3 * kDay + kHour);
  auto reader = reader_of(folder.file());
  const auto rows = value(reader.rows("x", kStart, kStart + 4 * kDay, 99999));
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows.front().time_ns, kStart + 2 * kDay + kHour);
  const auto hours =
      value(reader.history({"y", {Watched::resonance}, kStart, kStart + 3 * kDay, 100, Resolution::hour}));
  EXPECT_EQ(hours.time_ns.size(), 72U);
  EXPECT_EQ(hours.figures[0][0].rows, 360U);
  const auto parts = value(
      reader.history({"y", {Watched::resonance}, kStart, kStart + 3 * kDay, 1000, Resolution::five_minutes}));
  EXPECT_EQ(parts.time_ns.size(), 72U * 12U);
  EXPECT_EQ(parts.figures[0][0].rows, 30U);

  Batch late;  // rows of an hour that retention has emptied must not make a new one of the few
  late.rows = {record_of("x", kStart + 5 * kSecond, some_row(1'000'000))};
  EXPECT_EQ(value(store.commit(late)).expired_rows, 1U);
}

TEST(Upkeep, TheFileStaysBoundedAndWhatMustStayStays) {
  const Folder folder;
  constexpr std::uint64_t kLimit = 12'000'000;
  StoreOptions options;
  options.retention.bytes = kLimit;
  Store store = opened(folder.file(), options);
  Batch kept;
  kept.configurations = {{"text", 1}};
  kept.actions = {{"k", "x", 1, kStart, "relearn", "ann", "", "{}"}};
  kept.baselines = {{"x", 1, kStart, "first", "ann", "", some_row(1), {}}};
  for (const bool open : {true, false}) {
    AlarmRecord alarm;
    alarm.id = open ? "open" : "closed";
    alarm.axis = "x";
    alarm.open = open;
    kept.alarms.push_back(alarm);
    kept.evidence.push_back({alarm.id + ".csv", alarm.id, "x", 0, 10, kStart, 9'000'000});
  }
  value(store.commit(kept));
  std::uint64_t largest = 0;
  for (int day = 0; day < 4; ++day) {
    run_machine(store, {"x", "y", "z"}, kStart + day * kDay, kStart + (day + 1) * kDay, 6 * kSecond);
    largest = std::max(largest, store.file_bytes());
  }
  auto reader = reader_of(folder.file());
  // The closed alarm's evidence went, the open one's stays.
  EXPECT_EQ(value(reader.evidence_to_remove(10)), (std::vector<std::string>{"closed.csv"}));
  EXPECT_EQ(value(reader.evidence("open")).size(), 1U);
  EXPECT_TRUE(value(reader.evidence("closed")).empty());
  EXPECT_EQ(value(reader.alarms(AlarmFilter::all, {}, 10)).size(), 2U);
  EXPECT_EQ(value(reader.audit(10)).size(), 1U);
  EXPECT_EQ(value(reader.baselines("x", 10)).size(), 1U);
  EXPECT_TRUE(value(reader.configuration(configuration_hash("text"))));
  EXPECT_FALSE(value(reader.rows("x", kStart, kStart + 7 * kDay, 9)).empty());
  // 172 800 rows would be 11 MB; what is left beside 9 MB of evidence is 3 MB, and 16 MB may be free pages.
  EXPECT_LT(largest, kLimit - 9'000'000 + 17'000'000);
  Batch gone;
  gone.evidence_removed = {"closed.csv", "open.csv"};
  value(store.commit(gone));
  EXPECT_TRUE(value(reader.evidence_to_remove(10)).empty());
  EXPECT_EQ(value(reader.evidence("open")).size(), 1U);  // nobody asked for that
}

TEST(Upkeep, EvidenceDrivesOutNoTrends) {
  const auto run_with = [](const Folder& folder, std::uint64_t limit, int files) {
    StoreOptions options;
    options.retention.bytes = limit;
    Store store = opened(folder.file(), options);
    Batch batch;
    for (int i = 0; i < files; ++i)
      batch.evidence.push_back({std::to_string(i), std::to_string(i), "x", 0, 10, kStart + i, 1'000'000});
    value(store.commit(batch));
    run_machine(store, {"x"}, kStart, kStart + 2 * kDay, 6 * kSecond);
  };
  const Folder much, little;
  run_with(much, 12'000'000, 15);
  auto reader = reader_of(much.file());
  EXPECT_EQ(value(reader.rows("x", kStart, kStart + kHour, 999)).size(), 600U);
  EXPECT_EQ(
      count_in(much.file(), "SELECT count(*) FROM five_minutes WHERE start_ns = " + std::to_string(kStart)),
      1);
  const auto gone = value(reader.evidence_to_remove(99));
  EXPECT_GE(gone.size(), 4U);
  EXPECT_LE(gone.size(), 9U);
  EXPECT_TRUE(value(reader.evidence("0")).empty());
  EXPECT_EQ(value(reader.evidence("14")).size(), 1U);

  run_with(little, 2'400'000, 1);
  EXPECT_TRUE(value(reader_of(little.file()).evidence_to_remove(9)).empty());
  EXPECT_TRUE(value(reader_of(little.file()).rows("x", kStart, kStart + kHour, 999)).empty());
}

/// A day of rows each 10 s, the first half at 10 Hz, the second at 20 Hz; each hour is committed at the time
/// `now` says.
template <class Now>
void commit_day_of_halves(Store& store, Now&& now) {
  for (int hour = 0; hour < 24; ++hour) {
    Batch batch;
    for (int i = 360 * hour; i < 360 * (hour + 1); ++i)
      batch.rows.push_back(record_of("x", kStart + 10 * i * kSecond,
                                     some_row(static_cast<std::uint64_t>(i), hour < 12 ? 10.0 : 20.0)));
    value(store.commit(batch));
    keep_up(store, now(hour));
  }
}

void expect_day_of_halves(const Folder& folder) {
  const auto day =
      value(reader_of(folder.file())
                .history({"x", {Watched::resonance}, kStart, kStart + kDay, 9, Resolution::day}));
  ASSERT_EQ(day.time_ns.size(), 1U);
  EXPECT_EQ(day.figures[0][0].rows, 8640U);
  EXPECT_NEAR(day.figures[0][0].mean, 15.0, 1e-9);
}

TEST(Upkeep, ADayIsThatOfAllItsHoursHoweverShortTheyAreKept) {
  for (const double hours_s : {60.0, 7200.0, 43200.0, 86400.0}) {
    SCOPED_TRACE(hours_s);
    const Folder folder;
    StoreOptions options;
    options.retention.hours_s = hours_s;
    Store store = opened(folder.file(), options);
    commit_day_of_halves(store, [](int hour) { return kStart + (hour + 1) * kHour; });
    keep_up(store, kStart + kDay + 2 * kHour);
    expect_day_of_halves(folder);
    Batch next;
    next.rows = {record_of("x", kStart + kDay + kSecond, some_row(10'000))};
    value(store.commit(next));
    for (const auto minutes : {0, 2, 4})
      keep_up(store, kStart + 3 * kDay + kHour + minutes * 60 * kSecond);  // moved, settled, removed
    expect_day_of_halves(folder);
    EXPECT_EQ(count_in(folder.file(), "SELECT count(*) FROM hours"), 1);
  }
}

TEST(Upkeep, ADayThatComesLaterIsThatOfAllItsHours) {
  const Folder folder;
  StoreOptions options;
  options.retention.bytes = 1000;  // all that may go goes
  Store store = opened(folder.file(), options);
  commit_day_of_halves(store, [](int hour) { return kStart + 3 * kDay + hour * 20 * kSecond; });
  keep_up(store, kStart + 3 * kDay + kHour);
  expect_day_of_halves(folder);
}

TEST(Upkeep, SaysWhereNothingMoreMayBeRemoved) {
  const Folder folder;
  StoreOptions options;
  options.retention.bytes = 1000;
  Store store = opened(folder.file(), options);
  EXPECT_TRUE(value(store.upkeep(kStart)).over_limit);
}

TEST(Upkeep, SpaceIsReturnedInSmallSteps) {
  const Folder folder;
  StoreOptions options;
  options.retention.rows_s = 3 * 3600;
  Store store = opened(folder.file(), options);
  Batch batch;
  for (int i = 0; i < 300'000; ++i)
    batch.rows.push_back(
        record_of("x", kStart + i * (kSecond / 30), some_row(static_cast<std::uint64_t>(i))));
  value(store.commit(batch));
  keep_up(store, kStart);
  keep_up(store, kStart + 61 * kSecond);
  const auto before = store.file_bytes();
  const int steps = keep_up(store, kStart + kDay);
  EXPECT_GT(steps, 5);
  Batch nothing;
  value(store.commit(nothing));
  { Store moved = std::move(store); }  // closing copies the log into the file
  const auto after = std::filesystem::file_size(folder.file());
  EXPECT_LT(after, before);
  EXPECT_LT(after, 20'000'000U);
}

TEST(Upkeep, TheLogIsEmptiedAboveItsBoundOnceReadersLetGo) {
  const Folder folder;
  StoreOptions options;
  options.wal_bytes = 20'000'000;
  Store store = opened(folder.file(), options);
  std::uint64_t sample = 0;
  const auto grow = [&](int commits) {
    for (int i = 0; i < commits; ++i) {
      Batch batch;
      batch.snapshots.push_back(
          {"x", ++sample, 0, "", "", std::vector<std::byte>(1'000'000, static_cast<std::byte>(sample))});
      value(store.commit(batch));
    }
  };
  sqlite3* reader = nullptr;
  ASSERT_EQ(sqlite3_open(folder.file().c_str(), &reader), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(reader, "BEGIN; SELECT * FROM meta", nullptr, nullptr, nullptr), SQLITE_OK);
  grow(30);
  EXPECT_GT(store.wal_bytes(), 25'000'000U);  // the reader may need it
  sqlite3_close(reader);
  grow(30);
  EXPECT_LT(store.wal_bytes(), 22'000'000U);
}

TEST(Upkeep, KeysOfDeliveredMessagesAreForgottenInTheEnd) {
  const Folder folder;
  StoreOptions options;
  options.retention.delivered_s = 86400;
  Store store = opened(folder.file(), options);
  Batch batch;
  batch.outbox = {{"a", "t", "p", kStart}, {"b", "t", "p", kStart}};
  batch.deliveries = {{"a", kStart + 1, {}, ""}};
  value(store.commit(batch));
  keep_up(store, kStart + 2 * kDay);
  EXPECT_EQ(count_in(folder.file(), "SELECT count(*) FROM outbox"), 1);
  EXPECT_EQ(value(reader_of(folder.file()).outbox_due(kStart + 2 * kDay, 9, "t")).size(), 1U);
}

}  // namespace
}  // namespace resonid::monitor::test
