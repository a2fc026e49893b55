// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <response_modes_coverage.hpp>

namespace resonid::fit {
namespace {

TEST(ResponseModes, FindsThePairOfTwoMassesWithoutNoise) {
  const auto c = test::chain(2, 1.0, 0.02);
  auto g = test::noisy(c, 0.25, 0.0, 1);
  for (std::size_t i = 0; i < g.lines(); ++i) g.std[i] = 1e-6 * std::abs(g.value[i]);
  const auto modes = response_modes(g);
  const auto truth = c.roots();
  ASSERT_EQ(modes.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(modes[i].mode.anti, truth[i].anti);
    EXPECT_FALSE(modes[i].mode.from_model);
    EXPECT_NEAR(modes[i].mode.frequency_hz.value, truth[i].frequency_hz, 1e-4 * truth[i].frequency_hz);
    EXPECT_NEAR(modes[i].mode.damping_ratio.value, truth[i].damping_ratio, 1e-2 * truth[i].damping_ratio);
  }
  EXPECT_GT(modes[0].prominence_db, 10.0);
}

TEST(ResponseModes, FindsADipWhoseLinesDrown) {
  const auto c = test::chain(2, 1.0, 0.004);
  const auto g = test::noisy(c, 0.5, 0.04, 2);
  double least = 1e300, its_std = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i)
    if (std::abs(c.response(g.frequency_hz[i])) < least)
      least = std::abs(c.response(g.frequency_hz[i])), its_std = g.std[i];
  EXPECT_LT(least, its_std);
  const auto modes = response_modes(g);
  ASSERT_FALSE(modes.empty());
  EXPECT_TRUE(modes[0].mode.anti);
  EXPECT_NEAR(modes[0].mode.frequency_hz.value, 12.0, 3.0 * modes[0].mode.frequency_hz.std);
  EXPECT_LT(modes[0].mode.frequency_hz.std, 0.1);
}

TEST(ResponseModes, IntervalsHoldTheTruth) {
  test::ModesCoverage coverage;
  for (const int masses : {2, 3})
    for (const double ratio : {0.1, 1.0, 10.0})
      for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        const auto c = test::chain(masses, ratio, 0.01);
        coverage.add(c, test::noisy(c, 0.5, 0.01, seed));
      }
  EXPECT_GE(coverage.modes, 70);
  // 3 standard deviations of that many intervals at 95 %
  const double least = 0.95 - 3.0 * std::sqrt(0.95 * 0.05 / coverage.modes);
  EXPECT_GE(coverage.frequency, least * coverage.modes) << coverage.modes;
  EXPECT_GE(coverage.damping, least * coverage.modes) << coverage.modes;
  EXPECT_EQ(coverage.striking, 0);
}

TEST(ResponseModes, FindsNoneInARigidDrive) {
  test::Chain rigid;
  rigid.middle = 1e-9;
  rigid.stiffness = 1e3;
  rigid.friction = 0.3;
  rigid.delay_s = 0.003;
  int found = 0;
  for (const double noise : {0.01, 0.3})
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
      found += response_modes(test::noisy(rigid, 0.5, noise, seed), 0.5).empty() ? 0 : 1;
  EXPECT_EQ(found, 0);
}

TEST(ResponseModes, NeedsStandardDeviationsAndLines) {
  auto g = test::noisy(test::chain(2, 1.0, 0.02), 0.5, 0.01, 3);
  EXPECT_FALSE(response_modes(g).empty());
  EXPECT_TRUE(response_modes(g.band(11.0, 13.0)).empty());
  g.std.clear();
  EXPECT_TRUE(response_modes(g).empty());
}

}  // namespace
}  // namespace resonid::fit
