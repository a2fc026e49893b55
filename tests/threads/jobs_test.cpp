// SPDX-License-Identifier: MIT
// What `--jobs` shares between its threads, and the reader of large text files, for the thread sanitizer.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <resonid/io/detail/table.hpp>
#include <stdexcept>
#include <vector>

#include "linalg/parallel.hpp"

namespace resonid {
namespace {

using linalg::for_each_index;

TEST(Jobs, EveryIndexIsWorkedOnOnceAndItsResultIsSeen) {
  for (const std::size_t jobs : {1U, 2U, 7U, 64U}) {
    std::vector<double> result(1000, 0.0);  // each thread writes its own elements
    for_each_index(result.size(), jobs, [&](std::size_t i) { result[i] += static_cast<double>(i) + 1.0; });
    EXPECT_EQ(std::accumulate(result.begin(), result.end(), 0.0), 500500.0) << jobs;
  }
}

TEST(Jobs, TheFirstFailureComesOutAndEndsTheRest) {
  std::atomic<std::size_t> begun{0};
  const auto fails = [&](std::size_t i) {
    ++begun;
    if (i % 10 == 3) throw std::runtime_error("of task");
  };
  EXPECT_THROW(for_each_index(100000, 4, fails), std::runtime_error);
  EXPECT_LT(begun, 100000U);
}

TEST(Jobs, NothingToDoStartsNothing) {
  for_each_index(0, 8, [](std::size_t) { FAIL(); });
}

/// Larger than what one thread reads by itself (2 MiB).
TEST(Jobs, RegionsOfATextFileMeetInOneTable) {
  const auto path = std::filesystem::path(testing::TempDir()) / "resonid_threads.csv";
  constexpr std::size_t kRows = 300000;
  {
    std::ofstream file(path);
    file << "t,u,y\n";
    for (std::size_t i = 0; i < kRows; ++i)
      file << i << ".25," << i % 7 << ',' << -static_cast<int>(i) << '\n';
  }
  ASSERT_GT(std::filesystem::file_size(path), std::uintmax_t{5} << 20U);
  const auto table = io::read_csv(path);
  std::filesystem::remove(path);
  ASSERT_TRUE(table) << table.error().requirement;
  ASSERT_EQ(table->columns.size(), 3U);
  for (std::size_t i = 0; i < kRows; i += 997) {
    EXPECT_EQ(table->columns[0].at(i), static_cast<double>(i) + 0.25);
    EXPECT_EQ(table->columns[2].at(i), -static_cast<double>(i));
  }
  EXPECT_EQ(table->columns[1].size(), kRows);
}

}  // namespace
}  // namespace resonid
