// SPDX-License-Identifier: MIT
// What a design for the uncertainty of a machine promises, on draws that it has not seen.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "design/robust.hpp"
#include "golden_posteriors.hpp"

namespace resonid::design {
namespace {

TEST(ConfidentGains, KeepTheirProbabilityOnFreshDraws) {
  constexpr std::size_t kDraws = 10'000, kFresh = 100'000;
  const auto golden = test::golden_json("e_tune_robust.json");
  for (const auto& c : golden.at("cases")) {
    SCOPED_TRACE(c.at("label").dump());
    const auto posterior = test::golden_posterior(c);
    const auto found = confident_gains(posterior, {}, test::calm(), 0.95, kDraws, 3);
    ASSERT_TRUE(found);
    const double fresh =
        monte_carlo(posterior, found->design.controller, test::calm(), kFresh, 4).probability();
    std::printf("%s: radius %.2f, ki %.2f, exceeded by %.4f, on fresh draws %.4f\n",
                c.at("label").dump().c_str(), found->design.radius, found->design.controller.ki,
                found->check.probability(), fresh);
    // The radius is chosen by as many draws, which tell the probability to within their sampling error.
    const double chance = std::sqrt(0.05 * 0.95 * (1.0 / kDraws + 1.0 / kFresh));
    EXPECT_LT(fresh, 0.05 + 3.0 * chance);
    EXPECT_GT(fresh, 0.03);
  }
}

/// On the surface of the ellipsoid, where the largest are.
TEST(RobustGains, NoDrawInsideTheEllipsoidExceedsTheBounds) {
  const auto golden = test::golden_json("e_tune_robust.json");
  Bounds loose = test::calm();
  *loose.sensitivity *= 1.005;
  *loose.load_transfer *= 1.005;
  for (const auto& c : golden.at("cases")) {
    SCOPED_TRACE(c.at("label").dump());
    const auto posterior = test::golden_posterior(c);
    for (const double radius : {2.0, 3.33}) {
      const auto found = robust_gains(posterior, {}, test::calm(), radius);
      ASSERT_TRUE(found);
      EXPECT_EQ(monte_carlo(posterior, found->controller, loose, 20'000, 5, radius).exceeding, 0U);
    }
  }
}

}  // namespace
}  // namespace resonid::design
