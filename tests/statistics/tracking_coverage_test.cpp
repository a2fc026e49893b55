// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <string>

#include "closed_loop_fixture.hpp"

namespace resonid::test {
namespace {

// Publication IV: bank with lambda = 100, joint approach, noise 0.1, 30 s. 200 seeds x 8 lines; the truth
// lies in the 95 % regions in 93 ... 97 % of the cases (binomial deviation 0.5 %, the rest for the error
// bars' own uncertainty).
void expect_coverage(const data::TwoMassParameters& drive) {
  constexpr int kSeeds = 200;
  const double part = covered(drive, 1, kSeeds) / (8.0 * kSeeds);
  testing::Test::RecordProperty("covered_percent", std::to_string(100.0 * part));
  EXPECT_GE(part, 0.93);
  EXPECT_LE(part, 0.97);
}

TEST(TrackingCoverage, SystemA) { expect_coverage(system_a()); }
TEST(TrackingCoverage, SystemB) { expect_coverage(system_b()); }

}  // namespace
}  // namespace resonid::test
