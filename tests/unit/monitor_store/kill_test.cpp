// SPDX-License-Identifier: MIT
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "sanitized.hpp"
#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

constexpr const char* kAxes[] = {"a", "b", "c"};

/// The same for the same number, whoever makes it.
Batch numbered(std::uint64_t number) {
  std::mt19937_64 random(number);
  Batch batch;
  for (const char* axis : kAxes) {
    auto row = any_row(random);
    row.sample = number;
    batch.rows.push_back(record_of(axis, kStart + static_cast<std::int64_t>(number) * 20 * kSecond, row));
  }
  batch.snapshots.push_back(
      {"a", number, number, "1", "", std::vector<std::byte>(30'000, static_cast<std::byte>(number))});
  batch.positions.push_back({"b", number, 0, {number, ~number, 0, 0}});
  batch.events.push_back({"b", number, "gap", "raise", "id", kStart, std::to_string(number), "{}"});
  batch.actions.push_back({std::to_string(number), "c", number, kStart, "reset", "ann", "", "{}"});
  batch.outbox.push_back({std::to_string(number), "webhook", "payload", kStart});
  return batch;
}

/// Commits one batch after another, tells each in the pipe, and never returns.
[[noreturn]] void commit_for_ever(const std::string& file, std::uint64_t first, int pipe) {
  auto store = Store::open(file, {});
  if (!store) ::_exit(1);
  for (std::uint64_t number = first;; ++number) {
    if (!store->commit(numbered(number))) ::_exit(2);
    if (::write(pipe, &number, sizeof number) != sizeof number) ::_exit(3);
    // Rows are on the move, and hours are made, at many of the kills.
    for (int i = 0; i < 2; ++i)
      if (!store->upkeep(kStart + static_cast<std::int64_t>(number) * 20 * kSecond)) ::_exit(4);
  }
}

TEST(StoreKill, WhatWasCommittedIsThereAndIsWrittenOnce) {
  constexpr int kKills = RESONID_SANITIZED ? 10 : 100;
  const Folder folder;
  std::mt19937_64 random(3);
  std::uint64_t committed = 0;
  for (int kill = 0; kill < kKills; ++kill) {
    int pipe[2];
    ASSERT_EQ(::pipe(pipe), 0);
    // The last batches once more: the child does not know which of them arrived.
    const std::uint64_t first = committed > 2 ? committed - 2 : 1;
    const ::pid_t child = ::fork();
    if (child == 0) commit_for_ever(folder.file(), first, pipe[1]);
    ::close(pipe[1]);
    // Some are killed before they have begun, most some commits later, wherever they are then.
    std::uint64_t number = 0, newest = 0;
    const auto next = [&] { return ::read(pipe[0], &number, sizeof number) == sizeof number; };
    const std::uint64_t commits = random() % 5 == 0 ? 0 : random() % 20;
    for (std::uint64_t i = 0; i < commits && next(); ++i) newest = number;
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 20'000));
    ::kill(child, SIGKILL);
    while (next()) newest = number;
    ::close(pipe[0]);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status)) << "ended by itself with " << WEXITSTATUS(status);
    committed = std::max(committed, newest);

    Store store = opened(folder.file());  // whole, or it would be refused
    auto reader = reader_of(folder.file());
    const auto axes = value(reader.axes());
    if (committed == 0) continue;
    ASSERT_EQ(axes.size(), 3U);
    const std::uint64_t last = axes[0].newest_sample.value();
    ASSERT_TRUE(last == committed || last == committed + 1) << last << ' ' << committed;
    const auto found = value(reader.snapshot("a"));
    ASSERT_TRUE(found);
    ASSERT_FALSE(found->previous);
    ASSERT_EQ(found->snapshot.sample, last);
    const auto position = value(reader.position("b"));  // that of a repeated batch, or the newest
    ASSERT_TRUE(position);
    ASSERT_TRUE(position->word[0] + 3 >= first && position->word[0] <= last);
    ASSERT_EQ(position->word[1], ~position->word[0]);
  }
  ASSERT_GT(committed, static_cast<std::uint64_t>(kKills));
  Store store = opened(folder.file());
  auto reader = reader_of(folder.file());
  const std::uint64_t last = value(reader.axes())[0].newest_sample.value();
  for (std::uint64_t number = last - 5; number <= last; ++number) {
    const auto again = value(store.commit(numbered(number)));
    EXPECT_EQ(again.rows + again.events + again.actions, 0U);
  }
  const auto now = kStart + static_cast<std::int64_t>(last) * 20 * kSecond;
  keep_up(store, now + kHour);
  keep_up(store, now + 3 * kHour);
  for (const std::size_t axis : {0U, 1U, 2U}) {
    const auto rows = value(reader.rows(kAxes[axis], kStart, now + 1, 10'000'000));
    ASSERT_EQ(rows.size(), last);
    for (std::uint64_t i = 0; i < last; ++i)
      ASSERT_TRUE(same_bits(rows[i].row, numbered(i + 1).rows[axis].row)) << i;
  }
  EXPECT_EQ(value(reader.events("id", 1'000'000)).size(), last);
  EXPECT_EQ(value(reader.audit(1'000'000)).size(), last);
  EXPECT_EQ(value(reader.outbox_due(kStart, 1'000'000, "webhook")).size(), last);
  // Every row is in the statistics of its hour once.
  const auto hours = value(
      reader.history({"a", {monitoring::Watched::gap}, kStart, now + kHour, 100'000, Resolution::hour}));
  std::uint64_t counted = 0, finite = 0;
  for (const auto& hour : hours.figures[0]) counted += hour.rows;
  for (std::uint64_t i = 1; i <= last; ++i)
    finite += std::isfinite(numbered(i).rows[0].row[monitoring::Watched::gap].value) ? 1 : 0;
  EXPECT_EQ(counted, finite);
}

}  // namespace
}  // namespace resonid::monitor::test
