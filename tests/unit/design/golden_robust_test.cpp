// SPDX-License-Identifier: MIT
// Designs for every machine of an ellipsoid against an independent implementation
// (tests/golden/e_tune_robust.json).
#include <gtest/gtest.h>

#include <cmath>

#include "design/robust.hpp"
#include "golden_posteriors.hpp"

namespace resonid::design {
namespace {

constexpr double kRadius = 3.32723609;

/// Not below the golden one; above it is a better maximisation, since the value is that of a machine: 0.55 %
/// for one of these.
void expect_worst(const Posterior& posterior, const FilteredPi& controller, Transfer transfer, double radius,
                  double golden, double below = 5e-4) {
  const auto found = worst_case(posterior, controller, transfer, radius);
  EXPECT_GT(found.peak.value, golden * (1.0 - below));
  EXPECT_LT(found.peak.value, golden * (1.0 + 1e-2));
}

/// At the golden gains. Golden shares count what is beyond a bound by more than 1e-3 of it, the tolerance of
/// the golden active set (tests/golden/README.md): strict ones are up to 17 percentage points larger.
MonteCarlo expect_probability(const Posterior& posterior, const FilteredPi& controller, Bounds bounds,
                              double golden, double golden_draws, std::size_t draws,
                              double deviations = 3.0) {
  for (auto* bound : {&bounds.sensitivity, &bounds.load_transfer, &bounds.controller_sensitivity})
    if (*bound) **bound *= 1.0 + 1e-3;
  auto check = monte_carlo(posterior, controller, bounds, draws, 3);
  const auto own = static_cast<double>(draws);
  const double both = (golden * golden_draws + check.probability() * own) / (golden_draws + own);
  const double deviation = std::sqrt(both * (1.0 - both) * (1.0 / golden_draws + 1.0 / own));
  EXPECT_NEAR(check.probability(), golden, deviations * deviation);
  EXPECT_EQ(check.unstable, 0U);
  return check;
}

TEST(GoldenRobust, WorstCasesGainsAndProbabilities) {
  const auto golden = test::golden_json("e_tune_robust.json");
  ASSERT_EQ(golden.at("cases").size(), 4U);
  for (const auto& c : golden.at("cases")) {
    SCOPED_TRACE(c.at("label").dump());
    const Posterior posterior = test::golden_posterior(c);
    const auto& n = c.at("nominal");
    const FilteredPi nominal{n.at("kp"), n.at("ki"), {}};
    expect_worst(posterior, nominal, Transfer::sensitivity, kRadius,
                 n.at("worst").at("sensitivity").at("max"));
    expect_worst(posterior, nominal, Transfer::load_transfer, kRadius,
                 n.at("worst").at("load_transfer").at("max"));
    // All four of these golden shares, of 2000 draws, have about three deviations less of |S|, whatever room
    // is left at the bound.
    expect_probability(posterior, nominal, test::calm(), n.at("monte_carlo").at("p_exceed"),
                       n.at("monte_carlo").at("draws"), 10'000, 4.0);
    for (const char* which : {"robust", "radius_2"}) {
      SCOPED_TRACE(which);
      const auto& g = c.at(which);
      const double radius = g.at("radius");
      const FilteredPi given{g.at("kp"), g.at("ki"), {}};
      expect_worst(posterior, given, Transfer::sensitivity, radius, g.at("worst").at("sensitivity"));
      expect_worst(posterior, given, Transfer::load_transfer, radius, g.at("worst").at("load_transfer"));
      const auto found = robust_gains(posterior, {}, test::calm(), radius);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->controller.kp, given.kp, 0.01 * given.kp);
      EXPECT_NEAR(found->controller.ki, given.ki, 0.01 * given.ki);
      // So many that their own scatter is a part of the tolerance.
      const auto& m = g.at("monte_carlo");
      const auto check =
          expect_probability(posterior, given, test::calm(), m.at("p_exceed"), m.at("draws"), 40'000);
      const auto& q = m.at("q95");
      EXPECT_LT(std::abs(check.quantile_95[0] / q.at("sensitivity").get<double>() - 1.0), 3e-3);
      EXPECT_LT(std::abs(check.quantile_95[2] / q.at("load_transfer").get<double>() - 1.0), 3e-3);
    }
  }
}

/// An inertia J under C = k (1 - 0.8 z^-1)/0.2: at half the rate, after d whole samples, L = -(-1)^d 9 k
/// Ts/2J. 3 samples are nearest to the delay, and 4, where |C S| is largest, is 1.5 standard deviations away.
TEST(Robust, LooksAtEveryDelayOfWholeSamples) {
  constexpr double kStep = 0.002, kInertia = 0.032, kGain = 0.1 * kInertia / kStep;
  constexpr double kSpread = 0.02, kDelaySpread = 0.6, kDelay = 3.1, kOfEllipsoid = 2.0;
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(2, 2);
  covariance(0, 0) = kSpread * kSpread;
  covariance(1, 1) = std::pow(kDelaySpread * kStep, 2);
  const Posterior posterior(test::golden_machine({kInertia, 1e-5}, kStep, kDelay * kStep).model(),
                            {fit::kDrivenInertia, fit::kDelay}, covariance);
  const LinearController controller(data::TransferFunction{{5.0 * kGain, -4.0 * kGain}, {1.0}, kStep});
  const double away = (4.0 - kDelay) / kDelaySpread;
  const double lightest =
      kInertia * std::exp(-kSpread * std::sqrt(kOfEllipsoid * kOfEllipsoid - away * away));
  const double largest = 9.0 * kGain / (1.0 - 9.0 * kGain * kStep / (2.0 * lightest));
  const auto worst = worst_case(posterior, controller, Transfer::controller_sensitivity, kOfEllipsoid);
  EXPECT_GT(worst.peak.value, largest * (1.0 - 1e-3));
  EXPECT_LE(worst.u.norm(), kOfEllipsoid * (1.0 + 1e-9));
}

/// Golden gains and filters by what they are worth here; then the gains at those filters.
TEST(GoldenRobust, GainsBesideABiquad) {
  constexpr double kGoldenDraws = 4000.0;  // all shares are whole multiples of one of them
  const auto golden = test::golden_json("e_tune_robust.json").at("with_biquad");
  const Posterior posterior = test::golden_posterior(golden);
  const Machine machine(posterior.nominal());
  const Bounds bounds = test::golden_bounds(golden.at("bounds"));
  const auto with = [](const nlohmann::json& g, const nlohmann::json& biquad) {
    return FilteredPi{g.at("kp"), g.at("ki"), {{biquad.at(0), biquad.at(1), biquad.at(2)}}};
  };
  const auto expect_all_worst = [&](const FilteredPi& controller, double radius,
                                    const nlohmann::json& worst) {
    expect_worst(posterior, controller, Transfer::sensitivity, radius, worst.at("sensitivity"));
    expect_worst(posterior, controller, Transfer::load_transfer, radius, worst.at("load_transfer"));
    // At the Nyquist frequency |C S| has an edge at delays of whole samples, along which the maximum lies.
    expect_worst(posterior, controller, Transfer::controller_sensitivity, radius,
                 worst.at("controller_sensitivity"));
  };
  expect_all_worst(with(golden.at("nominal"), golden.at("biquad")), kRadius,
                   golden.at("nominal").at("worst"));
  ASSERT_EQ(golden.at("robust").size(), 4U);
  for (std::size_t i = 0; i < golden.at("robust").size(); ++i) {
    SCOPED_TRACE(i);
    const auto& g = golden.at("robust")[i];
    const double radius = g.at("radius");
    const FilteredPi given = with(g, g.at("biquad"));
    expect_all_worst(given, radius, g.at("worst"));
    expect_probability(posterior, given, bounds, g.at("p_exceed"), kGoldenDraws, 20'000);
    const double iae = g.at("load_step").at("iae");
    EXPECT_NEAR(load_step_iae(machine, given), iae, 1e-5 * iae);

    // Golden gains exceed their bounds by up to 1e-3; the last ones by 3e-3, at a machine that the golden
    // search missed. Gains at what those keep are as large.
    Bounds kept = bounds;
    kept.sensitivity = worst_case(posterior, given, Transfer::sensitivity, radius).peak.value;
    kept.load_transfer = worst_case(posterior, given, Transfer::load_transfer, radius).peak.value;
    const auto found = robust_gains(posterior, given.biquads, kept, radius);
    ASSERT_TRUE(found);
    const double tolerance = i == 3 ? 0.03 : 0.01;
    EXPECT_NEAR(found->controller.kp, given.kp, tolerance * given.kp);
    EXPECT_NEAR(found->controller.ki, given.ki, tolerance * given.ki);
  }
}

}  // namespace
}  // namespace resonid::design
