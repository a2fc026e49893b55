// SPDX-License-Identifier: MIT
// How often `compare` calls two results of one machine changed, and how often it misses a stiffness of 5 %.
#include <cstdio>
#include <repetitions.hpp>
#include <resonid/identification/compare.hpp>
#include <vector>

namespace resonid {
namespace {

/// 20 disjoint pairs: at 95 % more than 4 are called changed once in 400 times.
TEST(Compare, CallsRepetitionsUnchanged) {
  constexpr std::uint64_t kPairs = 20;
  int changed = 0, missed = 0;
  for (std::uint64_t pair = 0; pair < kPairs; ++pair) {
    const auto first = test::identified_repetition(100 + 2 * pair),
               again = test::identified_repetition(101 + 2 * pair);
    if (identification::compare(first, again).value().changed) ++changed;
    if (pair % 4 != 0) continue;
    const auto softer = test::identified_repetition(500 + pair, 0.95);
    if (!identification::compare(first, softer).value().changed) ++missed;
  }
  std::printf("changed %d of %d, missed %d\n", changed, static_cast<int>(kPairs), missed);
  EXPECT_LE(changed, 4);
  EXPECT_EQ(missed, 0);
}

}  // namespace
}  // namespace resonid
