// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/plant/detail/white_noise.hpp>

namespace resonid::plant {
namespace {

// Bounds are five standard deviations of each statistic of 200 000 independent normal numbers.
TEST(WhiteNoise, IsNormalAndWhite) {
  constexpr int kCount = 200000;
  WhiteNoise noise(1, 2.0);
  double mean = 0.0, square = 0.0, fourth = 0.0, lagged = 0.0, before = 0.0;
  int beyond = 0;
  for (int k = 0; k < kCount; ++k) {
    const double x = noise.step() / 2.0;
    mean += x / kCount;
    square += x * x / kCount;
    fourth += x * x * x * x / kCount;
    lagged += x * before / kCount;
    beyond += std::abs(x) > 1.959964 ? 1 : 0;
    before = x;
  }
  const double sigma = 1.0 / std::sqrt(static_cast<double>(kCount));
  EXPECT_NEAR(mean, 0.0, 5.0 * sigma);
  EXPECT_NEAR(square, 1.0, 5.0 * std::sqrt(2.0) * sigma);
  EXPECT_NEAR(fourth, 3.0, 5.0 * std::sqrt(96.0) * sigma);
  EXPECT_NEAR(lagged, 0.0, 5.0 * sigma);
  EXPECT_NEAR(beyond / static_cast<double>(kCount), 0.05, 5.0 * std::sqrt(0.05 * 0.95) * sigma);
}

TEST(WhiteNoise, DependsOnTheSeedAlone) {
  WhiteNoise one(1, 1.0), again(1, 1.0), two(2, 1.0);
  for (int k = 0; k < 100; ++k) {
    const double x = one.step();
    EXPECT_EQ(x, again.step());
    EXPECT_NE(x, two.step());
  }
}

}  // namespace
}  // namespace resonid::plant
