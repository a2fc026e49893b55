// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <planned_experiment.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/planning/plan.hpp>

namespace resonid::planning {
namespace {

PlanConfig quick() {
  PlanConfig c;
  c.drive = test::rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
  c.limits.torque = 1.0;
  c.period_s = 1.0;
  c.spread = 0.0;
  return c;
}

TEST(Plan, KeepsEveryLimitOnThePlant) {
  auto c = quick();
  c.spread = 0.1;
  c.type = ExcitationType::multisine;
  c.limits.excitation = 1.2;
  c.limits.velocity = 0.5;
  c.limits.stroke = 0.06;
  c.limits.torque_rms = 0.5;
  c.targets = {{"stiffness", 0.02, true}};
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  EXPECT_TRUE(plan->reached);
  const auto run = test::without_noise(test::planned_experiment(plan->planned(), 0.1));
  EXPECT_LE(test::peak(run.record.input.samples), 1.0);
  EXPECT_LE(test::peak(run.record.excitation.samples), 1.2);
  EXPECT_LE(test::peak(run.record.output.samples), 0.5);
  double position = 0.0, low = 0.0, high = 0.0;
  for (const double v : run.record.output.samples) {
    position += 0.002 * v;
    low = std::min(low, position);
    high = std::max(high, position);
  }
  EXPECT_LE(high - low, 0.0605);
  // One limit is used up, over the drives that it may be.
  const auto& e = plan->planned().peaks;
  EXPECT_NEAR(
      std::max({e.torque / 1.0, e.excitation / 1.2, e.velocity / 0.5, e.stroke / 0.06, e.torque_rms / 0.5}),
      1.0, 1e-9);
}

TEST(Plan, TakesTheLeastWholeNumberOfPeriods) {
  auto c = quick();
  c.type = ExcitationType::multisine;
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  const auto& x = plan->planned();
  EXPECT_TRUE(plan->reached);
  EXPECT_LE(x.ratio, 1.0);
  EXPECT_EQ(x.excitation.size(), x.periods * x.period_samples);
  EXPECT_EQ(x.period_samples, 500U);
  ASSERT_GT(x.periods, x.settle_periods + 2);
  c.limits.time_s = x.duration_s - 1.0;  // a period less is too little
  const auto shorter = make_plan(c);
  EXPECT_FALSE(shorter->reached);
  EXPECT_GT(shorter->planned().ratio, 1.0);
  EXPECT_LT(shorter->planned().ratio, 1.2);
}

TEST(Plan, NeedsLessTimeThanChirpAndPrbs) {
  auto c = quick();
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  EXPECT_EQ(plan->planned().type, ExcitationType::multisine);
  ASSERT_EQ(plan->experiments.size(), 3U);
  EXPECT_GT(*plan->experiments[1].needed_s, 1.5 * *plan->planned().needed_s);
  EXPECT_GT(*plan->experiments[2].needed_s, 1.5 * *plan->planned().needed_s);
}

TEST(Plan, LaysOutTheKindThatIsAskedFor) {
  auto c = quick();
  c.targets = {{"resonance", 0.01, true}, {"phase_margin", 1.0, false}};
  for (const auto type : {ExcitationType::chirp, ExcitationType::prbs}) {
    c.type = type;
    const auto plan = make_plan(c);
    ASSERT_TRUE(plan.has_value());
    EXPECT_EQ(plan->planned().type, type);
    EXPECT_TRUE(plan->reached);
  }
}

TEST(Plan, PlansARigidDriveInOpenLoop) {
  PlanConfig c;
  c.drive.model.structure = fit::Structure::rigid;
  c.drive.model.parameters.driven_inertia = 0.01;
  c.drive.model.sample_time_s = 0.001;
  c.drive.model.estimated = fit::estimated_parameters(fit::Structure::rigid, false, false);
  c.drive.noise.innovation_variance = 0.01;
  c.limits.torque = 0.5;
  c.limits.stroke = 0.5;
  c.type = ExcitationType::multisine;
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  EXPECT_TRUE(plan->reached);
  EXPECT_LE(plan->planned().peaks.stroke, 0.5 + 1e-9);
}

// The amplitude that is said to do does: fed-back noise, which no amplitude strengthens, is left out.
/// Without a controller a start with some rigid velocity would carry the drive away, the further the longer.
TEST(Plan, ALongerTimeTellsMoreWithinTheSameStroke) {
  auto c = quick();
  c.drive.controller.reset();
  c.type = ExcitationType::multisine;
  c.limits.stroke = 0.05;
  c.targets = {{"stiffness", 1e-6, true}};
  std::vector<double> ratio;
  for (const double time_s : {5.0, 20.0, 80.0}) {
    c.limits.time_s = time_s;
    const auto plan = make_plan(c);
    ASSERT_TRUE(plan.has_value());
    EXPECT_LE(plan->planned().peaks.stroke, 0.05 * (1.0 + 1e-9));
    ratio.push_back(plan->planned().ratio);
  }
  EXPECT_LT(ratio[1], 0.6 * ratio[0]);
  EXPECT_LT(ratio[2], 0.6 * ratio[1]);
}

TEST(Plan, SaysWhatAmplitudeWouldDo) {
  auto c = quick();
  c.type = ExcitationType::multisine;
  c.limits.torque = 1e-4;
  c.limits.time_s = 8.0;
  const auto weak = make_plan(c);
  ASSERT_TRUE(weak.has_value());
  EXPECT_FALSE(weak->reached);
  EXPECT_TRUE(weak->planned().noise_dominates);
  ASSERT_TRUE(weak->planned().needed_amplitude.has_value());
  const double factor = *weak->planned().needed_amplitude;
  EXPECT_GT(factor, 10.0 * weak->planned().ratio);
  c.limits.torque = 1e-4 * factor;
  const auto strong = make_plan(c);
  EXPECT_FALSE(strong->planned().noise_dominates);
  EXPECT_NEAR(strong->planned().ratio, 1.0, 0.05);
  EXPECT_GT(strong->noise_torque, 0.0);
}

TEST(Plan, LooksNoFurtherThanTenMinutesUnlessTold) {
  auto c = quick();
  c.type = ExcitationType::multisine;
  c.limits.stroke = 1e-6;
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  EXPECT_FALSE(plan->reached);
  EXPECT_LE(plan->planned().duration_s, kMostTime_s);
}

TEST(Plan, ComparesWhatIsLaidOut) {
  auto c = quick();
  c.targets = {{"stiffness", 0.02, true}};
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  ASSERT_TRUE(plan->reached);
  EXPECT_EQ(plan->planned().least_s, plan->planned().duration_s);
  for (const auto& x : plan->experiments) EXPECT_GE(x.least_s.value_or(HUGE_VAL), plan->planned().duration_s);
}

// Measured on the samples themselves, by their discrete Fourier transform.
double part_of_power(const std::vector<double>& x, double sample_rate_hz, double from_hz, double to_hz) {
  const std::size_t n = x.size();
  double inside = 0.0, all = 0.0;
  for (const double v : x) all += v * v / 2.0;
  for (std::size_t l = 0; 2 * l < n; ++l) {
    const double f = static_cast<double>(l) * sample_rate_hz / static_cast<double>(n);
    if (f < from_hz || f >= to_hz) continue;
    const std::complex<double> step =
        std::polar(1.0, -kTwoPi * static_cast<double>(l) / static_cast<double>(n));
    std::complex<double> turn = 1.0, sum = 0.0;
    for (const double v : x) {
      sum += v * turn;
      turn *= step;
    }
    inside += std::norm(sum) / static_cast<double>(n) * (l == 0 ? 0.5 : 1.0);
  }
  return inside / all;
}

TEST(Plan, KeepsAPrbsWithinABandThatIsGiven) {
  auto c = quick();
  c.band_hz = {2.0, 40.0};
  c.type = ExcitationType::prbs;
  c.limits.time_s = 10.0;
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  const auto& x = plan->planned();
  const double above = part_of_power(x.excitation, 500.0, 40.0, 251.0);
  const double below = part_of_power(x.excitation, 500.0, 0.0, 2.0);
  EXPECT_LE(x.power_above_band, 0.1);
  EXPECT_LE(x.power_below_band, 0.2);
  // A record of 10 s has of a long PRBS's spectrum a sample: 20 lines below 2 Hz.
  EXPECT_NEAR(above, x.power_above_band, 0.03);
  EXPECT_NEAR(below, x.power_below_band, 0.05);
}

TEST(Plan, LeavesOutAPrbsThatDoesNotFitTheBand) {
  auto c = quick();
  c.band_hz = {5.0, 30.0};
  c.targets = {{"stiffness", 0.02, true}};
  const auto plan = make_plan(c);
  ASSERT_TRUE(plan.has_value());
  ASSERT_EQ(plan->skipped.size(), 1U);
  EXPECT_EQ(plan->skipped[0].type, ExcitationType::prbs);
  EXPECT_EQ(plan->experiments.size(), 2U);
  for (const double f : plan->planned().frequency_hz) {
    EXPECT_GE(f, 5.0 - 1e-9);
    EXPECT_LE(f, 30.0 + 1e-9);
  }
}

// Two steps are told where the second run, planned for what the first leaves open, is predicted to be short.
TEST(Plan, TellsTwoStepsWhereTheyTakeClearlyLess) {
  auto c = quick();
  c.spread = 0.5;
  const auto wide = make_plan(c);
  ASSERT_TRUE(wide.has_value());
  ASSERT_TRUE(wide->two_stages.has_value());
  const auto& two = *wide->two_stages;
  EXPECT_LE(two.total_s(), 0.8 * two.one_s);
  EXPECT_LE(two.spread, 0.25);
  EXPECT_GT(two.spread, 0.0);
  c.spread = two.spread;  // the second run, had the rough model been right
  c.type = ExcitationType::multisine;
  const auto second = make_plan(c);
  EXPECT_TRUE(second->reached);
  EXPECT_LT(second->planned().duration_s, two.one_s);
  c.spread = 0.05;
  EXPECT_FALSE(make_plan(c)->two_stages.has_value());
}

TEST(Plan, RefusesNamingTheField) {
  const auto refused = [](auto&& change) {
    auto c = quick();
    change(c);
    const auto plan = make_plan(c);
    return plan ? std::string("nothing") : std::string(plan.error().field);
  };
  EXPECT_EQ(refused([](PlanConfig& c) { c.limits.torque = -1.0; }), "max_torque");
  EXPECT_EQ(refused([](PlanConfig& c) { c.limits.torque = HUGE_VAL; }), "max_torque");
  EXPECT_EQ(refused([](PlanConfig& c) { c.limits.time_s = 0.01; }), "max_time_s");
  EXPECT_EQ(refused([](PlanConfig& c) { c.targets = {{"colour", 0.1, true}}; }), "accuracy");
  EXPECT_EQ(refused([](PlanConfig& c) { c.spread = 0.9; }), "spread");
  EXPECT_EQ(refused([](PlanConfig& c) { c.period_s = 100.0; }), "period_s");
  EXPECT_EQ(refused([](PlanConfig& c) { c.band_hz = {5.0, 400.0}; }), "band");
  EXPECT_EQ(refused([](PlanConfig& c) { c.drive.noise.innovation_variance = 0.0; }), "noise");
  EXPECT_EQ(refused([](PlanConfig& c) { c.drive.model.parameters.stiffness = -1.0; }), "stiffness");
  EXPECT_EQ(refused([](PlanConfig& c) { c.drive.model.structure = fit::Structure::three_mass; }),
            "middle_inertia");
  EXPECT_EQ(refused([](PlanConfig& c) { c.limits.stroke = 0.0; }), "max_stroke");
  EXPECT_EQ(refused([](PlanConfig& c) { c.targets = {{"resonance_2", 0.1, true}}; }), "accuracy");
  EXPECT_EQ(refused([](PlanConfig& c) {
              c.band_hz = {5.0, 30.0};
              c.type = ExcitationType::prbs;
            }),
            "band");
}

}  // namespace
}  // namespace resonid::planning
