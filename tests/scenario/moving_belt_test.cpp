// SPDX-License-Identifier: MIT
// Estimators on line on a belt that moves under an unknown load, a few seeds; all of them: tests/statistics.
#include <gtest/gtest.h>

#include <moving_belt.hpp>

namespace resonid {
namespace {

class MovingBelt : public testing::TestWithParam<const char*> {};

TEST_P(MovingBelt, IsFollowedWithMarginsAndGapFromAStiffnessThatIsOff) {
  const auto belt = test::moving_belt(GetParam(), 3, 1.1);
  const auto physical = test::physical_on(belt, true);
  const auto instrumental = test::instrumental_on(belt, true);
  const auto damped = test::damped_closed_loop_on(belt, true);
  EXPECT_LE(physical.resonance.rms(), 0.0020);
  EXPECT_LE(instrumental.resonance.rms(), 0.0035);
  EXPECT_LE(damped.resonance.rms(), 0.0040);
  for (const auto& e : {physical, instrumental, damped}) {
    EXPECT_GT(e.trusted, 0.95 * e.rows);
    EXPECT_LE(e.crossover.rms(), 0.02);
    EXPECT_LE(e.phase_margin_deg.rms(), 1.5);
    EXPECT_LE(e.modulus_margin.rms(), 0.03);
    EXPECT_LE(e.gap.rms(), 0.03);
  }
}

INSTANTIATE_TEST_SUITE_P(SampleTimes, MovingBelt,
                         testing::Values("ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms"));

}  // namespace
}  // namespace resonid
