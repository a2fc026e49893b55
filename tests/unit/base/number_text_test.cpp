// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <resonid/base/detail/number_text.hpp>

namespace resonid {
namespace {

TEST(NumberText, EndsAtTheSecondDigitOfTheError) {
  EXPECT_EQ(with_error(15.1063, 0.0312), "15.106 +- 0.031");
  EXPECT_EQ(with_error(143.78, 0.57), "143.78 +- 0.57");
  EXPECT_EQ(with_error(-143.78, 5.7), "-143.8 +- 5.7");
  EXPECT_EQ(with_error(143.78, 57.0), "144 +- 57");
  EXPECT_EQ(with_error(54321.0, 1234.0), "54321 +- 1234");
}

TEST(NumberText, TurnsToPowersWhereFiguresAreSmallOrLarge) {
  EXPECT_EQ(with_error(4.5678e-5, 1.2e-7), "4.568e-05 +- 1.2e-07");
  EXPECT_EQ(with_error(1.23456e7, 3.4e5), "1.23e+07 +- 3.4e+05");
  EXPECT_EQ(with_error(12.345678901234, 1e-10), "12.345679 +- 1e-10");
}

TEST(NumberText, HasFiveDigitsWithoutAnError) {
  const double inf = std::numeric_limits<double>::infinity();
  for (const double none : {0.0, -1.0, inf, std::nan("")}) EXPECT_EQ(with_error(15.10634, none), "15.106");
  EXPECT_EQ(with_error(0.0, 0.0), "0");
  EXPECT_EQ(with_error(inf, 0.0), "inf");
  EXPECT_EQ(with_error(0.0, 0.5), "0 +- 0.5");
}

TEST(NumberText, WritesOtherValuesWithTheSameDigits) {
  const ErrorDigits digits(143.78, 0.57);
  EXPECT_EQ(digits.value(136.4), "136.40");
  EXPECT_EQ(digits.half_width(0.57), "0.57");
  EXPECT_EQ(ErrorDigits(1.0, 0.0).half_width(0.0), "");
}

}  // namespace
}  // namespace resonid
