// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <reproduce/runs.hpp>
#include <resonid/base/constants.hpp>

namespace resonid::reproduction {
namespace {

TEST(Spectrum, OfAPulse) {
  // Geometric sum: |sin(pi f N/fs) / sin(pi f/fs)| / fs.
  constexpr double kRate = 100.0;
  const std::vector<double> frequencies{0.7, 3.0, 12.5};
  const auto found = spectrum(std::vector<double>(40, 2.0), kRate, frequencies);
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const double half = kPi * frequencies[i] / kRate;
    EXPECT_NEAR(found[i], 2.0 * std::abs(std::sin(40.0 * half) / std::sin(half)) / kRate, 1e-12);
  }
}

TEST(Grid, HoldsBothEnds) {
  const auto grid = grid_hz(1.8, 33.0, 0.04);
  ASSERT_EQ(grid.size(), 781U);
  EXPECT_DOUBLE_EQ(grid.front(), 1.8);
  EXPECT_NEAR(grid.back(), 33.0, 1e-9);
  EXPECT_EQ(grid_hz(1.0, 1.95, 0.5).size(), 2U);
}

}  // namespace
}  // namespace resonid::reproduction
