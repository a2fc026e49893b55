// SPDX-License-Identifier: MIT
#include <map>
#include <monitor/store/backlog.hpp>

#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

Batch second_of(std::uint64_t sample) {
  Batch batch;
  for (const char* axis : {"x", "y"}) {
    batch.rows.push_back(record_of(axis, static_cast<std::int64_t>(sample) * kSecond, some_row(sample)));
    batch.snapshots.push_back({axis, sample, sample, "", "", {}});
  }
  batch.positions.push_back({"source", sample, 0, {sample}});
  batch.events.push_back({"x", sample, "a", "t", "id", 0, "", ""});
  batch.actions.push_back({std::to_string(sample), "x", sample, 0, "", "", "", ""});
  return batch;
}

TEST(Backlog, ThinsRowsAndDropsNoEvent) {
  Backlog backlog(1000);
  EXPECT_TRUE(backlog.empty());
  for (std::uint64_t i = 0; i < 5000; ++i) backlog.add(second_of(i));
  const Batch& all = backlog.batch();
  EXPECT_LE(all.rows.size(), 1000U);
  EXPECT_GE(all.rows.size(), 400U);
  EXPECT_EQ(all.rows.size() + backlog.dropped_rows(), 10'000U);
  EXPECT_EQ(all.events.size(), 5000U);
  EXPECT_EQ(all.actions.size(), 5000U);
  ASSERT_EQ(all.snapshots.size(), 2U);
  EXPECT_EQ(all.snapshots[0].sample, 4999U);
  ASSERT_EQ(all.positions.size(), 1U);
  EXPECT_EQ(all.positions[0].word[0], 4999U);
  std::map<std::string, std::int64_t> newest;
  for (const auto& row : all.rows) {  // in order, of both axes, the newest among them
    EXPECT_GT(static_cast<std::int64_t>(row.row.sample), newest.try_emplace(row.axis, -1).first->second);
    newest[row.axis] = static_cast<std::int64_t>(row.row.sample);
  }
  EXPECT_EQ(newest["x"], 4999);
  EXPECT_EQ(newest["y"], 4999);
  EXPECT_LT(all.rows.front().row.sample, 200U);  // the beginning of the outage is still there
  backlog.clear();
  EXPECT_TRUE(backlog.empty());
  EXPECT_TRUE(backlog.batch().rows.empty());
}

TEST(Backlog, IsBoundedWhereEveryRowHasItsOwnAxis) {
  Backlog backlog(10);
  Batch batch;
  for (std::uint64_t i = 0; i < 100; ++i)
    batch.rows.push_back(record_of("axis" + std::to_string(i), 0, some_row(i)));
  backlog.add(std::move(batch));
  ASSERT_EQ(backlog.batch().rows.size(), 10U);
  EXPECT_EQ(backlog.batch().rows.front().row.sample, 90U);
}

}  // namespace
}  // namespace resonid::monitor::test
