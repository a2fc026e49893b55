// SPDX-License-Identifier: MIT
#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

TEST(Reader, AnAlarmThatClearedIsFoundBehindAnyNumberOfActiveOnes) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  for (int i = 0; i < 5; ++i) {
    AlarmRecord alarm;
    alarm.id = std::to_string(i);
    alarm.axis = "x";
    alarm.alarm = "stiffness";
    alarm.active = i > 1;
    alarm.open = i > 0;
    alarm.raised_ns = kStart + i;
    alarm.json = "{}";
    batch.alarms.push_back(alarm);
  }
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  const auto newest = [&](AlarmFilter filter, std::size_t limit) {
    std::string ids;
    for (const auto& alarm : value(reader.alarms(filter, std::nullopt, limit))) ids += alarm.id;
    return ids;
  };
  EXPECT_EQ(newest(AlarmFilter::cleared, 1), "1");
  EXPECT_EQ(newest(AlarmFilter::cleared, 10), "10");
  EXPECT_EQ(newest(AlarmFilter::open, 10), "4321");
}

TEST(Reader, ActiveAlarmsAreCountedWhateverTheirNumber) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  const auto alarm_of = [](int id, int severity, bool active) {
    AlarmRecord alarm;
    alarm.id = std::to_string(id);
    alarm.axis = "x";
    alarm.severity = severity;
    alarm.active = active;
    return alarm;
  };
  for (int i = 0; i < 2000; ++i) batch.alarms.push_back(alarm_of(i, i < 3 ? 2 : 1, i % 2 == 0));
  batch.alarms[4].open = false;  // its axis is gone
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  using Counts = std::map<int, std::uint64_t>;
  EXPECT_EQ(value(reader.active_alarms({})), (Counts{{1, 997}, {2, 2}}));
  // Not written yet: one that cleared, one whose severity has changed, one that came back, a new one.
  const std::vector<AlarmRecord> newer = {alarm_of(0, 2, false), alarm_of(2, 0, true), alarm_of(5, 1, true),
                                          alarm_of(9999, 1, true)};
  EXPECT_EQ(value(reader.active_alarms(newer)), (Counts{{0, 1}, {1, 999}, {2, 0}}));
}

TEST(Reader, AlarmsThatWereOpenWithinATimeAreFound) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  const auto add = [&](const char* id, std::int64_t raised_s, std::optional<std::int64_t> cleared_s,
                       std::int64_t last_s) {  // of its transitions; 0: it is open yet
    AlarmRecord alarm;
    alarm.id = id;
    alarm.axis = "x";
    alarm.alarm = id;
    alarm.active = !cleared_s;
    alarm.open = last_s == 0;
    alarm.raised_ns = kStart + raised_s * kSecond;
    if (cleared_s) alarm.cleared_ns = kStart + *cleared_s * kSecond;
    alarm.json = "{}";
    batch.alarms.push_back(alarm);
    EventRecord event;
    event.axis = "x";
    event.alarm = id;
    event.alarm_id = id;
    event.transition = "acknowledged";
    event.time_ns = kStart + std::max(last_s, raised_s) * kSecond;
    event.json = "{}";
    batch.events.push_back(event);
  };
  add("a", 10, 20, 20);
  add("b", 11, 20, 50);  // acknowledged at 50
  add("c", 12, {}, 0);
  add("d", 13, 20, 0);  // cleared, and waits to be acknowledged
  add("e", 60, 70, 70);
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  const auto within = [&](std::int64_t from_s, std::int64_t to_s) {
    std::string ids;
    for (const auto& alarm : value(
             reader.alarms(AlarmFilter::all, "x", 10, {kStart + from_s * kSecond, kStart + to_s * kSecond})))
      ids += alarm.id;
    return ids;
  };
  EXPECT_EQ(within(0, 10), "");
  EXPECT_EQ(within(0, 12), "ba");
  EXPECT_EQ(within(15, 60), "dcba");
  EXPECT_EQ(within(30, 61), "edcb");
  EXPECT_EQ(within(51, 55), "dc");
  EXPECT_EQ(value(reader.alarms(AlarmFilter::all, std::nullopt, 10)).size(), 5U);
}

TEST(Reader, TheAuditGoesBackInPieces) {
  const Folder folder;
  Store store = opened(folder.file());
  Batch batch;
  for (int i = 0; i < 4; ++i) {
    ActionRecord action;
    action.key = std::to_string(i);
    action.axis = "x";
    action.time_ns = kStart + i;
    action.kind = "acknowledge";
    action.arguments = "{}";
    batch.actions.push_back(action);
  }
  value(store.commit(batch));
  auto reader = reader_of(folder.file());
  const auto keys = [&](std::size_t limit, const TimeSpan& span) {
    std::string all;
    for (const auto& action : value(reader.audit(limit, span))) all += action.key;
    return all;
  };
  EXPECT_EQ(keys(2, {}), "32");
  TimeSpan before;
  before.to_ns = kStart + 2;
  EXPECT_EQ(keys(2, before), "10");
  EXPECT_EQ(keys(9, {kStart + 1, kStart + 3}), "21");
}

}  // namespace
}  // namespace resonid::monitor::test
