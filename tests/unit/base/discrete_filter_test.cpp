// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <resonid/base/detail/discrete_filter.hpp>
#include <type_traits>
#include <vector>

namespace resonid {
namespace {

using Filter = DiscreteFilter<double, 4>;
static_assert(std::is_trivially_copyable_v<Filter>);

double signal(int k) { return std::sin(0.7 * k) + 0.3 * std::cos(2.9 * k * k); }

TEST(DiscreteFilter, FollowsItsDifferenceEquation) {
  auto filter = Filter::create(std::vector{0.4, 0.2, -0.6}, std::vector{2.0, -1.0}).value();
  double y1 = 0.0;
  for (int k = 0; k < 50; ++k) {
    const auto u = [k](int i) { return k >= i ? signal(k - i) : 0.0; };
    const double y = 0.2 * u(0) + 0.1 * u(1) - 0.3 * u(2) + 0.5 * y1;
    EXPECT_NEAR(filter.step(signal(k)), y, 1e-14);
    y1 = y;
  }
}

TEST(DiscreteFilter, CommittingItsOwnOutputIsAStepBitForBit) {
  for (const auto& [b, a] : std::vector<std::pair<std::vector<double>, std::vector<double>>>{
           {{1.3}, {1.0}}, {{1.1, -1.0}, {1.0, -1.0}}, {{0.1, 0.7, 0.2}, {1.1, -1.3, 0.5, 0.1, -0.02}}}) {
    auto whole = Filter::create(b, a).value();
    auto halves = whole;
    for (int k = 0; k < 200; ++k) {
      const double y = halves.output(signal(k));
      EXPECT_EQ(halves.output(signal(k)), y);  // remembers nothing
      halves.commit(signal(k), y);
      EXPECT_EQ(whole.step(signal(k)), y);
    }
  }
}

// y(k) = b0 u(k) + b1 u(k-1) - a1 w(k-1) - a2 w(k-2), w what was realised of y.
TEST(DiscreteFilter, GoesOnFromTheRealisedOutput) {
  auto filter = Filter::create(std::vector{0.8, -0.3}, std::vector{1.0, -1.6, 0.65}).value();
  double u1 = 0.0;
  double w1 = 0.0;
  double w2 = 0.0;
  bool limited = false;
  for (int k = 0; k < 100; ++k) {
    const double y = filter.output(signal(k));
    EXPECT_NEAR(y, 0.8 * signal(k) - 0.3 * u1 + 1.6 * w1 - 0.65 * w2, 1e-13);
    const double realised = std::clamp(y, -0.5, 0.5);
    limited = limited || realised != y;
    filter.commit(signal(k), realised);
    u1 = signal(k);
    w2 = w1;
    w1 = realised;
  }
  EXPECT_TRUE(limited);
}

}  // namespace
}  // namespace resonid
