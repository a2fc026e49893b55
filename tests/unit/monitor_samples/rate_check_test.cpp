// SPDX-License-Identifier: MIT
#include "monitor/samples/rate_check.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <random>

namespace resonid::monitor {
namespace {

/// Messages of 0.1 s that come up to 0.08 s late, for that long.
struct Sender {
  double rate_hz = 1000.0, seconds = 200.0;
  double jump_at_s = 1e9, jump_s = 0.0;    // of the clock
  double pause_at_s = 1e9, pause_s = 0.0;  // then all that waited comes at once
  double speed = 1.0;                      // of a recording
};
struct Found {
  int times = 0;
  double rate_hz = 0.0;
};
Found found(const Sender& s) {
  RateCheck check(1000.0);
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> late(0.0, 0.08);
  Found all;
  std::uint64_t sample = 0;
  for (double t = 0.1; t < s.seconds; t += 0.1) {
    sample = static_cast<std::uint64_t>(t * s.rate_hz);
    double at = t + late(generator);
    if (t > s.pause_at_s && t < s.pause_at_s + s.pause_s) at = s.pause_at_s + s.pause_s;
    if (t > s.jump_at_s) at += s.jump_s;
    if (const auto rate = check.step(sample, at / s.speed)) {
      ++all.times;
      all.rate_hz = *rate;
    }
  }
  return all;
}

TEST(RateCheck, TellsOfOnePerCentWithinMinutes) {
  for (const double rate : {990.0, 1010.0, 500.0, 2000.0}) {
    const auto f = found({rate});
    EXPECT_GE(f.times, 2) << rate;
    EXPECT_LE(f.times, 3) << rate;
    EXPECT_NEAR(f.rate_hz, rate, 1.5) << rate;
  }
}

TEST(RateCheck, SaysNothingOfTheRateThatWasTold) {
  EXPECT_EQ(found({1000.0, 3600.0}).times, 0);
  EXPECT_EQ(found({1001.0, 3600.0}).times, 0);  // crystals differ by less
}

TEST(RateCheck, TakesNoJumpAndNoPauseForARate) {
  Sender jumps;
  jumps.seconds = 600.0;
  for (const double jump : {2.0, -2.0, 3600.0, -3600.0}) {
    jumps.jump_at_s = 33.0;
    jumps.jump_s = jump;
    EXPECT_EQ(found(jumps).times, 0) << jump;
  }
  Sender pauses;
  pauses.seconds = 600.0;
  for (const double at : {20.0, 50.0, 77.0}) {
    pauses.pause_at_s = at;
    pauses.pause_s = 20.0;
    EXPECT_EQ(found(pauses).times, 0) << at;
  }
}

TEST(RateCheck, SaysNothingOfARecordingThatIsSentAsFastAsItGoes) {
  Sender fast;
  fast.seconds = 3600.0;
  fast.speed = 20.0;
  EXPECT_EQ(found(fast).times, 0);
}

}  // namespace
}  // namespace resonid::monitor
