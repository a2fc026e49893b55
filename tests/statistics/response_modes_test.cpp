// SPDX-License-Identifier: MIT
// Whether the error bars of resonances read from a response are right, and whether any are read from noise.
#include <gtest/gtest.h>

#include <response_modes_coverage.hpp>

namespace resonid {
namespace {

TEST(ResponseModesStatistics, IntervalsHoldTheTruth) {
  test::ModesCoverage all;
  for (const int masses : {2, 3})
    for (const double ratio : {0.1, 1.0, 10.0})
      for (const double damping : {0.004, 0.02, 0.1})
        for (const double spacing : {0.2, 0.5})
          for (const double noise : {0.01, 0.04})
            for (std::uint64_t seed = 1001; seed <= 1025; ++seed) {
              const auto c = test::chain(masses, ratio, damping);
              all.add(c, test::noisy(c, spacing, noise, seed));
            }
  const double frequency = 100.0 * all.frequency / all.modes, damping = 100.0 * all.damping / all.modes;
  RecordProperty("frequency", std::to_string(frequency));
  RecordProperty("damping", std::to_string(damping));
  EXPECT_GE(frequency, 93.0);
  EXPECT_LE(frequency, 97.5);
  EXPECT_GE(damping, 93.0);
  EXPECT_LE(damping, 97.5);
  EXPECT_LE(all.striking, all.modes / 500);
}

TEST(ResponseModesStatistics, NoiseOfARigidDriveShowsNone) {
  int found = 0, responses = 0;
  for (const double friction : {0.0, 0.3})
    for (const double noise : {0.01, 0.1, 0.4})
      for (const double spacing : {0.1, 0.5})
        for (std::uint64_t seed = 1; seed <= 100; ++seed, ++responses) {
          test::Chain rigid;
          rigid.middle = 1e-9;
          rigid.stiffness = 1e3;
          rigid.friction = friction;
          rigid.delay_s = 0.003;
          found += fit::response_modes(test::noisy(rigid, spacing, noise, seed), 0.5).empty() ? 0 : 1;
        }
  EXPECT_LE(found, responses / 100);
}

}  // namespace
}  // namespace resonid
