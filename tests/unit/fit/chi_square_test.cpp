// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>
#include <resonid/fit/detail/chi_square.hpp>

namespace resonid {
namespace {

// scipy.stats.chi2.sf(x, degrees); the first three are the usual 5 % quantiles.
TEST(ChiSquare, TailAgreesWithScipy) {
  EXPECT_NEAR(fit::chi_square_tail(3.841458820694124, 1), 0.05, 1e-12);
  EXPECT_NEAR(fit::chi_square_tail(9.487729036781154, 4), 0.05, 1e-12);
  EXPECT_NEAR(fit::chi_square_tail(124.34211340400407, 100), 0.05, 1e-12);
  EXPECT_NEAR(fit::chi_square_tail(10.0, 15), 0.8197399195036016, 1e-12);
}

TEST(ChiSquare, HasItsLimits) {
  EXPECT_EQ(fit::chi_square_tail(5.0, 0), 1.0);
  EXPECT_EQ(fit::chi_square_tail(0.0, 3), 1.0);
  EXPECT_EQ(fit::chi_square_tail(std::numeric_limits<double>::infinity(), 3), 0.0);
}

}  // namespace
}  // namespace resonid
