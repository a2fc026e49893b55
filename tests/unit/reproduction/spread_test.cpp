// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <reproduce/spread.hpp>

namespace resonid::reproduction {
namespace {

TEST(Spread, OfAFewValues) {
  const auto s = spread({1.0, 3.0, 5.0});
  EXPECT_DOUBLE_EQ(s.mean, 3.0);
  EXPECT_DOUBLE_EQ(s.deviation, 2.0);
  EXPECT_EQ(s.values, 3U);
  EXPECT_EQ(s.missing, 0U);
  EXPECT_EQ(row("f", "Hz", s).note, "");
  EXPECT_EQ(spread({7.0}).deviation, 0.0);
}

TEST(Spread, EqualValuesHaveNone) { EXPECT_EQ(spread({0.1, 0.1, 0.1}).deviation, 0.0); }

TEST(Spread, CountsWhatIsMissingAndSaysSo) {
  const auto s = spread({1.0, std::nan(""), 3.0, 5.0});
  EXPECT_DOUBLE_EQ(s.mean, 3.0);
  EXPECT_DOUBLE_EQ(s.deviation, 2.0);
  EXPECT_EQ(s.missing, 1U);
  const auto r = row("f", "Hz", s, 3.1, 3.2, "a word");
  EXPECT_DOUBLE_EQ(r.reproduced.value(), 3.0);
  EXPECT_DOUBLE_EQ(r.truth.value(), 3.1);
  EXPECT_DOUBLE_EQ(r.published.value(), 3.2);
  EXPECT_EQ(r.note, "a word; no value in 1 of 4");
}

TEST(Spread, OfNothingIsNoNumber) {
  const auto s = spread({std::nan(""), std::nan("")});
  EXPECT_TRUE(std::isnan(s.mean));
  const auto r = row("f", "Hz", s);
  EXPECT_FALSE(r.reproduced);
  EXPECT_FALSE(r.deviation);
  EXPECT_EQ(r.note, "no value");
  EXPECT_EQ(row("f", "Hz", std::nan("")).note, "no value");
}

}  // namespace
}  // namespace resonid::reproduction
