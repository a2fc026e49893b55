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

}  // namespace
}  // namespace resonid::monitor::test
