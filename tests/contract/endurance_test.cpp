// SPDX-License-Identifier: MIT
// Single precision does not drift: what bench/float_endurance.cpp shows over 1e9 samples, over 1e7.
#include <gtest/gtest.h>

#include <float_endurance.hpp>

namespace resonid::test {
namespace {

TEST(FloatEndurance, LineBankDoesNotDrift) {
  const Endurance error = line_bank_endurance(10000000);
  EXPECT_LT(error.late, 1e-4);
  EXPECT_LT(error.late, 2.0 * error.early);
  EXPECT_GT(error.late, 0.0);
}

TEST(FloatEndurance, ChirpTrackerDoesNotDrift) { EXPECT_LT(chirp_tracker_endurance(10000000).late, 1e-4); }

TEST(FloatEndurance, SlidingDftDoesNotDrift) {
  const Endurance error = sliding_dft_endurance(10000000);
  EXPECT_LT(error.late, 1e-4);
  EXPECT_LT(error.late, 2.0 * error.early);
}

}  // namespace
}  // namespace resonid::test
