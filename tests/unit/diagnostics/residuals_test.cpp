// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::diagnostics {
namespace {

TEST(ResidualTest, WhiteResidualStaysBelowTheLimitAndAMissedPartDoesNot) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  std::vector<double> simulated(8000), white(8000), missed(8000);
  for (std::size_t k = 0; k < simulated.size(); ++k) {
    simulated[k] = std::sin(0.05 * static_cast<double>(k)) + 4.0;
    white[k] = normal(random);
    missed[k] = white[k] + (k > 0 ? 0.5 * (simulated[k - 1] - 4.0) : 0.0);
  }
  const auto good = test_residual(white, simulated, 20, 5);
  EXPECT_NEAR(good.limit, 2.17 / std::sqrt(8000.0), 1e-15);
  EXPECT_LT(good.cross_correlation_max, good.limit);
  EXPECT_DOUBLE_EQ(good.autocorrelation[0], 1.0);
  EXPECT_EQ(good.cross_correlation.size(), 20U);
  EXPECT_GT(test_residual(missed, simulated, 20, 5).cross_correlation_max, 0.2);
}

TEST(ResidualTest, EmptyIsHarmless) { EXPECT_TRUE(test_residual({}, {}, 5, 5).autocorrelation.empty()); }

}  // namespace
}  // namespace resonid::diagnostics
