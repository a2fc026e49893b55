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

/// With a filter that was searched on the worst machines, at three confidences; no draw may be unstable.
TEST(ConfidentDesign, KeepsItsProbabilityOnFreshDraws) {
  constexpr std::size_t kFresh = 100'000;
  const auto golden = test::golden_json("e_tune_robust.json");
  std::vector<nlohmann::json> cases = golden.at("cases");
  cases.push_back(golden.at("with_biquad"));
  for (const auto& c : cases)
    for (const double confidence : {0.8, 0.95, 0.99}) {
      SCOPED_TRACE(testing::Message() << c.at("covariance").dump() << " " << confidence);
      const auto posterior = test::golden_posterior(c);
      const auto found = confident_design(posterior, {}, test::calm(), {.probability = confidence});
      ASSERT_TRUE(found);
      const auto fresh = monte_carlo(posterior, found->design.controller, found->bounds, kFresh, 12);
      const double allowed = 1.0 - confidence;
      std::printf("%.2f: radius %.2f, ki %.2f, IAE %.4f, exceeded by %.4f, on fresh draws %.4f\n", confidence,
                  found->design.radius, found->design.controller.ki, found->iae, found->check.probability(),
                  fresh.probability());
      const double chance = std::sqrt(allowed * confidence * (1.0 / 10'000 + 1.0 / kFresh));
      EXPECT_LT(fresh.probability(), allowed + 3.0 * chance);
      EXPECT_GT(fresh.probability(), 0.6 * allowed);
      EXPECT_EQ(fresh.unstable, 0U);
    }
}

TEST(ConfidentDesign, KeepsItsBoundsOnTheWholeEllipsoid) {
  const auto golden = test::golden_json("e_tune_robust.json");
  std::vector<nlohmann::json> cases = golden.at("cases");
  cases.push_back(golden.at("with_biquad"));
  for (const auto& c : cases) {
    SCOPED_TRACE(c.at("covariance").dump());
    const auto posterior = test::golden_posterior(c);
    const auto found = confident_design(posterior, {}, test::calm(), {.guarantee = Guarantee::ellipsoid});
    ASSERT_TRUE(found);
    Bounds loose = found->bounds;
    for (auto* bound : {&loose.sensitivity, &loose.load_transfer, &loose.controller_sensitivity})
      **bound *= 1.005;
    const auto surface =
        monte_carlo(posterior, found->design.controller, loose, 20'000, 13, found->design.radius);
    EXPECT_EQ(surface.exceeding, 0U);
    EXPECT_LT(monte_carlo(posterior, found->design.controller, found->bounds, 100'000, 14).probability(),
              0.01);
  }
}

}  // namespace
}  // namespace resonid::design
