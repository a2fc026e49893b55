// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <limits>
#include <resonid/base/detail/statistics.hpp>
#include <span>
#include <vector>

namespace resonid {
namespace {

// scipy.stats.chi2.sf(x, degrees); the first three are the usual 5 % quantiles.
TEST(ChiSquare, TailAgreesWithScipy) {
  EXPECT_NEAR(chi_square_tail(3.841458820694124, 1), 0.05, 1e-12);
  EXPECT_NEAR(chi_square_tail(9.487729036781154, 4), 0.05, 1e-12);
  EXPECT_NEAR(chi_square_tail(124.34211340400407, 100), 0.05, 1e-12);
  EXPECT_NEAR(chi_square_tail(10.0, 15), 0.8197399195036016, 1e-12);
}

TEST(ChiSquare, HasItsLimits) {
  EXPECT_EQ(chi_square_tail(5.0, 0), 1.0);
  EXPECT_EQ(chi_square_tail(0.0, 3), 1.0);
  EXPECT_EQ(chi_square_tail(std::numeric_limits<double>::infinity(), 3), 0.0);
}

TEST(Statistics, MedianIsTheUpperMiddle) {
  std::vector<double> values{5.0, 1.0, 4.0, 2.0};
  EXPECT_EQ(median(values), 4.0);
  EXPECT_EQ(median_in_place(std::span(values).first(3)), 4.0);
  EXPECT_EQ(median({}), 0.0);
}

TEST(Statistics, FitPercentIsOfTheNorms) {
  EXPECT_EQ(fit_percent_of(4.0, 16.0), 50.0);
  EXPECT_EQ(fit_percent_of(4.0, 0.0), 0.0);
}

// scipy.stats.norm.ppf(0.5 + 0.5 * confidence)
TEST(Statistics, TwoSidedQuantileAgreesWithScipy) {
  EXPECT_NEAR(two_sided_quantile(0.95), 1.959963984540054, 1e-12);
  EXPECT_NEAR(two_sided_quantile(0.5), 0.6744897501960817, 1e-12);
}

}  // namespace
}  // namespace resonid
