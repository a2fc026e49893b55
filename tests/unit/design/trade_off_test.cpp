// SPDX-License-Identifier: MIT
// What bounds and a better experiment are worth, against golden gains.
#include "design/trade_off.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "design/closed_loop.hpp"
#include "design/robust.hpp"
#include "golden_posteriors.hpp"

namespace resonid::design {
namespace {

/// ki of a golden PI of system 2.
std::optional<double> golden_ki(const nlohmann::json& golden, double sensitivity, double load_transfer) {
  for (const auto& c : golden.at("cases"))
    if (c.at("plant") == "system2" &&
        c.at("bounds") == nlohmann::json{{"sensitivity", sensitivity}, {"load_transfer", load_transfer}})
      return c.at("ki").get<double>();
  return std::nullopt;
}

const TradeOff& at(const std::vector<TradeOff>& curve, double sensitivity, double load_transfer) {
  return *std::find_if(curve.begin(), curve.end(), [&](const TradeOff& t) {
    return std::abs(t.sensitivity - sensitivity) < 1e-9 && std::abs(t.load_transfer - load_transfer) < 1e-9;
  });
}

TEST(TradeOffs, GoThroughTheGoldenGains) {
  const auto golden = test::golden_json("e_tune_pi.json");
  const auto machine =
      test::golden_posterior(test::golden_json("e_tune_robust.json").at("cases")[0]).nominal();
  const auto found = trade_offs({Machine(machine)}, {}, test::calm());
  ASSERT_EQ(found.over_sensitivity.size(), 9U);
  ASSERT_EQ(found.over_load_transfer.size(), 10U);
  const auto calm = golden_ki(golden, 1.4, 1.3), stiff = golden_ki(golden, 1.4, 1.5);
  ASSERT_TRUE(calm && stiff);
  EXPECT_NEAR(at(found.over_sensitivity, 1.4, 1.3).ki, *calm, 1e-5 * *calm);
  EXPECT_NEAR(at(found.over_load_transfer, 1.4, 1.3).ki, *calm, 1e-5 * *calm);
  EXPECT_NEAR(at(found.over_load_transfer, 1.4, 1.5).ki, *stiff, 1e-5 * *stiff);
  for (const auto* curve : {&found.over_sensitivity, &found.over_load_transfer})
    for (std::size_t i = 1; i < curve->size(); ++i)
      EXPECT_GE((*curve)[i].ki, (*curve)[i - 1].ki * (1 - 1e-9));
}

/// One controller for a machine and a softer one: as slow as the stricter of both asks, or slower.
TEST(TradeOffs, AreOfOneControllerForAllMachines) {
  const auto model = test::golden_posterior(test::golden_json("e_tune_robust.json").at("cases")[0]).nominal();
  auto soft = model;
  soft.parameters.stiffness *= 0.7;
  const auto of_one = trade_offs({Machine(model)}, {}, test::calm()),
             of_soft = trade_offs({Machine(soft)}, {}, test::calm()),
             of_both = trade_offs({Machine(model), Machine(soft)}, {}, test::calm());
  for (const auto curve : {&TradeOffs::over_sensitivity, &TradeOffs::over_load_transfer}) {
    ASSERT_EQ((of_both.*curve).size(), (of_one.*curve).size());
    ASSERT_EQ((of_both.*curve).size(), (of_soft.*curve).size());
    for (std::size_t i = 0; i < (of_both.*curve).size(); ++i) {
      const auto& both = (of_both.*curve)[i];
      const double stricter = std::min((of_one.*curve)[i].ki, (of_soft.*curve)[i].ki);
      EXPECT_LE(both.ki, stricter * (1 + 1e-6)) << i;
      EXPECT_GE(both.ki, 0.7 * stricter) << i;
      const FilteredPi controller{both.kp, both.ki, {}};
      EXPECT_NEAR(
          both.iae,
          0.5 * (load_step_iae(Machine(model), controller) + load_step_iae(Machine(soft), controller)),
          1e-9 * both.iae);
    }
  }
}

TEST(TradeOffs, TellTheMaximumWhereThereIsNoBound) {
  const auto golden = test::golden_json("e_tune_robust.json");
  Bounds bounds;
  bounds.sensitivity = 1.4;
  const auto found =
      trade_offs({Machine(test::golden_posterior(golden.at("cases")[0]).nominal())}, {}, bounds);
  ASSERT_EQ(found.over_sensitivity.size(), 9U);
  EXPECT_NEAR(found.over_sensitivity[2].load_transfer, 1.91, 0.01);  // docs/methods/tune.md 2.4
}

TEST(ExperimentValue, IsThatOfASmallerEllipsoid) {
  const auto golden = test::golden_json("e_tune_robust.json");
  for (const auto& c : golden.at("cases")) {
    SCOPED_TRACE(c.at("label").dump());
    const auto posterior = test::golden_posterior(c);
    const double radius = c.at("robust").at("radius"), robust = c.at("robust").at("ki"),
                 nominal = c.at("nominal").at("ki");
    const auto values = value_of_experiment(posterior, {}, test::calm(), radius);
    ASSERT_EQ(values.size(), 4U);
    EXPECT_NEAR(values[0].ki, robust, 0.01 * robust);
    EXPECT_NEAR(values[0].iae, c.at("robust").at("load_step").at("iae").get<double>(), 0.01 * values[0].iae);
    const auto half = robust_gains(posterior, {}, test::calm(), 0.5 * radius);
    ASSERT_TRUE(half);
    EXPECT_NEAR(values[1].ki, half->controller.ki, 1e-3 * values[1].ki);
    EXPECT_NEAR(values[2].ki, nominal, 1e-5 * nominal);
    EXPECT_EQ(values[2].factor, 0.0);
  }
}

/// A delay that is known to 0.1 ms leaves 90 % of ki at parameters of 1 %, one known to 0.4 ms 66 %.
TEST(ExperimentValue, IsThatOfTheDelayAboveAll) {
  auto golden = test::golden_json("e_tune_robust.json").at("cases")[0];
  for (const auto& [delay_std_s, left] : {std::pair(1e-4, 0.90), std::pair(4e-4, 0.66)}) {
    golden["covariance"][4][4] = delay_std_s * delay_std_s;
    const auto values = value_of_experiment(test::golden_posterior(golden), {}, test::calm(), 3.3272357436);
    ASSERT_EQ(values.size(), 4U);
    EXPECT_NEAR(values[0].ki / values[2].ki, left, 0.006);
    // Alone it is worth what it costs beside parameters that are as they are.
    golden["covariance"][4][4] = 0.0;
    const auto known = value_of_experiment(test::golden_posterior(golden), {}, test::calm(), 3.3272357436);
    EXPECT_NEAR(values[3].ki, known[0].ki, 1e-3 * known[0].ki);
    EXPECT_EQ(values[3].delay_factor, 0.0);
    EXPECT_EQ(values[3].factor, 1.0);
  }
}

/// A delay that nobody fitted is as uncertain after a longer experiment.
TEST(ExperimentValue, LeavesADelayThatWasTold) {
  const auto golden = test::golden_json("e_tune_robust.json").at("cases")[0];
  constexpr double kDelayStd_s = 4e-4;
  auto model = test::golden_posterior(golden).nominal();
  for (const auto p : {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping}) {
    model.estimated[p] = true;
    model.covariance(p, p) = std::pow(0.02 * model.value(p), 2);
  }
  const Posterior posterior(model, kDelayStd_s);
  EXPECT_TRUE(posterior.delay_is_told());
  const auto values = value_of_experiment(posterior, {}, test::calm(), 2.0);
  ASSERT_EQ(values.size(), 4U);
  // Without any other uncertainty: the delay's worst is two standard deviations later, a machine of its own.
  auto late = model;
  late.set(fit::kDelay, model.value(fit::kDelay) + 2.0 * kDelayStd_s);
  Machines both({Machine(model), Machine(late)});
  // Robust gains aim so much lower than the bounds.
  const auto gains = largest_integral_gain(both, {}, tightened(test::calm(), 3e-4));
  ASSERT_TRUE(gains);
  EXPECT_NEAR(values[2].ki, gains->ki, 1e-3 * gains->ki);
  EXPECT_LT(values[0].ki, values[1].ki);
  EXPECT_LT(values[1].ki, values[2].ki);
  EXPECT_GT(values[3].ki, values[2].ki);
}

/// A fit knows a delay and a stiffness as one thing rather than as two: where the one is known, the other is
/// too (the conditional covariance of a normal distribution).
TEST(ExperimentValue, OfAKnownDelayIsThatOfWhatItLeavesUnknown) {
  auto golden = test::golden_json("e_tune_robust.json").at("cases")[0];
  auto model = test::golden_posterior(golden).nominal();
  constexpr double kStd = 0.1, kDelayStd_s = 1e-3, kCorrelation = 0.98;
  model.covariance.setZero();
  model.estimated[fit::kLoadInertia] = model.estimated[fit::kDelay] = true;
  const double of_inertia = kStd * model.value(fit::kLoadInertia);
  model.covariance(fit::kLoadInertia, fit::kLoadInertia) = of_inertia * of_inertia;
  model.covariance(fit::kDelay, fit::kDelay) = kDelayStd_s * kDelayStd_s;
  model.covariance(fit::kDelay, fit::kLoadInertia) = model.covariance(fit::kLoadInertia, fit::kDelay) =
      kCorrelation * of_inertia * kDelayStd_s;
  const Posterior posterior(model, 0.0);
  ASSERT_FALSE(posterior.delay_is_told());
  const auto known = posterior.scaled(1.0, 0.0);
  double largest = 0.0;
  for (const double angle : {0.0, 0.4, 0.8, 1.2, 1.6, 2.0, 2.4, 2.8}) {
    Eigen::VectorXd u = Eigen::VectorXd::Zero(posterior.dimension());
    u(0) = std::cos(angle);
    u(1) = std::sin(angle);
    const auto machine = known.at(u);
    EXPECT_NEAR(machine.delay_s, model.delay_s, 1e-12);
    largest = std::max(largest,
                       std::abs(std::log(machine.value(fit::kLoadInertia) / model.value(fit::kLoadInertia))));
  }
  const double left = kStd * std::sqrt(1.0 - kCorrelation * kCorrelation);
  EXPECT_LE(largest, left * (1.0 + 1e-9));
  EXPECT_GT(largest, 0.9 * left);
  const auto values = value_of_experiment(posterior, {}, test::calm(), 2.0);
  ASSERT_EQ(values.size(), 4U);
  EXPECT_LT(values[3].iae, values[0].iae);
  EXPECT_LT(values[2].iae, values[3].iae);
}

/// Where a search gets stuck or finds nothing, what was found for more machines is as good as it was there.
TEST(ExperimentValue, IsNeverWorseOfLessUncertainty) {
  const ValueAt stuck = [](const VarianceFactors& factors) -> std::optional<ExperimentValue> {
    if (factors.all == 0.25) return ExperimentValue{1.0, 4.0, 0.25, 1.0};
    if (factors.all == 1.0 && factors.delay == 0.0) return std::nullopt;
    if (factors.all == 0.0) return ExperimentValue{1.0, 8.0, 0.125, 1.0};
    return ExperimentValue{1.0, 5.0, 0.2, 1.0};
  };
  const auto fitted = values_of_experiments(false, stuck);
  ASSERT_EQ(fitted.size(), 4U);
  const double iae[] = {0.2, 0.2, 0.125, 0.2}, all[] = {1.0, 0.25, 0.0, 1.0}, delay[] = {1.0, 0.25, 0.0, 0.0};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(fitted[i].iae, iae[i]) << i;
    EXPECT_EQ(fitted[i].factor, all[i]) << i;
    EXPECT_EQ(fitted[i].delay_factor, delay[i]) << i;
  }
  // The design that is proposed is one of them, and where nothing is found anywhere, nothing is told.
  const auto proposed = values_of_experiments(false, stuck, ExperimentValue{1.0, 6.0, 0.15, 1.0});
  ASSERT_EQ(proposed.size(), 4U);
  EXPECT_EQ(proposed[0].ki, 6.0);
  EXPECT_EQ(proposed[3].ki, 6.0);
  EXPECT_EQ(proposed[2].ki, 8.0);
  EXPECT_TRUE(values_of_experiments(true, [](const VarianceFactors&) {
                return std::optional<ExperimentValue>();
              }).empty());
}

}  // namespace
}  // namespace resonid::design
