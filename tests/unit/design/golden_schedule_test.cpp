// SPDX-License-Identifier: MIT
// Gains over the position of a tooth belt against an independent implementation
// (tests/golden/e_tune_structures.json, "schedule").
#include <gtest/gtest.h>

#include <cmath>
#include <golden.hpp>

#include "design/largest_gain.hpp"
#include "design/robust.hpp"
#include "design/schedule.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

constexpr Stroke kStroke = test::kBeltStroke;

ScheduleOptions options_of(const nlohmann::json& golden) {
  ScheduleOptions options;
  options.bounds = test::golden_bounds(golden.at("bounds"));
  return options;
}

double value_of(const FrozenMargins& margins, Transfer transfer) {
  for (const auto& maximum : margins.maxima)
    if (maximum.peak.transfer == transfer) return maximum.peak.value;
  return 0.0;
}

void expect_frozen(const FrozenMargins& margins, const nlohmann::json& golden) {
  EXPECT_TRUE(margins.stable);
  EXPECT_NEAR(value_of(margins, Transfer::sensitivity), golden.at("frozen_max_sensitivity").get<double>(),
              5e-4);
  EXPECT_NEAR(value_of(margins, Transfer::load_transfer), golden.at("frozen_max_load_transfer").get<double>(),
              5e-4);
}

void expect_near(double value, double golden, double tolerance) {
  EXPECT_NEAR(value / golden, 1.0, tolerance);
}

TEST(GoldenSchedule, TheBeltIsThatOfTheGoldenFile) {
  const auto golden = test::golden_json("e_tune_structures.json").at("schedule");
  for (const auto& [position, p] : golden.at("parameters").items()) {
    const auto belt = test::tooth_belt_at(std::stod(position)).parameters;
    expect_near(belt.load_inertia, p[1], 1e-9);
    expect_near(belt.stiffness, p[2], 1e-9);
    expect_near(belt.damping, p[3], 1e-9);
  }
}

TEST(GoldenSchedule, NodesFrozenMarginsAndRuns) {
  const auto golden = test::golden_json("e_tune_structures.json").at("schedule");
  for (const auto& nodes : golden.at("nodes")) {
    ScheduleOptions options = options_of(golden);
    options.first_nodes = nodes.at("position_m").size();
    SCOPED_TRACE(options.first_nodes);
    const auto design = design_schedule(test::tooth_belt_at, kStroke, options);
    ASSERT_TRUE(design);
    ASSERT_EQ(design->schedule.nodes().size(), options.first_nodes);
    for (std::size_t i = 0; i < options.first_nodes; ++i) {
      const ScheduleNode& node = design->schedule.nodes()[i];
      EXPECT_NEAR(node.position, nodes.at("position_m")[i].get<double>(), 1e-9);
      expect_near(node.kp, nodes.at("kp")[i], 2e-4);
      expect_near(node.ki, nodes.at("ki")[i], 2e-4);
    }
    expect_frozen(design->margins, nodes);
    const auto run = run_through(test::tooth_belt_at, design->schedule, kStroke, 1.0);
    expect_near(run.iae, nodes.at("run_iae"), 1e-3);
    expect_near(run.peak, nodes.at("run_peak"), 1e-3);
  }
}

TEST(GoldenSchedule, OneForAllAndTheNominalOne) {
  const auto golden = test::golden_json("e_tune_structures.json").at("schedule");
  const ScheduleOptions options = options_of(golden);
  const auto one = one_for_all(test::tooth_belt_at, kStroke, options);
  ASSERT_TRUE(one);
  const auto& expected_one = golden.at("one_pi_for_all");
  expect_near(one->schedule.at(1.0).kp, expected_one.at("kp"), 2e-4);
  expect_near(one->schedule.at(1.0).ki, expected_one.at("ki"), 2e-4);
  expect_frozen(one->margins, expected_one);
  expect_near(run_through(test::tooth_belt_at, one->schedule, kStroke, 1.0).iae, expected_one.at("run_iae"),
              1e-3);

  const auto& nominal = golden.at("nominal_at_0_6");
  Machines at_0_6({Machine(test::tooth_belt_at(0.6))});
  const auto gains = largest_integral_gain(at_0_6, {}, options.bounds);
  ASSERT_TRUE(gains);
  expect_near(gains->kp, nominal.at("kp"), 2e-4);
  expect_near(gains->ki, nominal.at("ki"), 2e-4);
  const GainSchedule everywhere({{0.6, gains->kp, gains->ki}});
  expect_frozen(frozen_margins(test::tooth_belt_at, everywhere, kStroke, options.bounds), nominal);
}

/// As if the belt were there twice as stiff near the middle: two nodes do not do.
fit::DriveModel stiff_in_the_middle(double position) {
  fit::DriveModel model = test::tooth_belt_at(1.0);
  model.parameters.stiffness *= 1.0 + 2.0 * std::exp(-std::pow((position - 1.0) / 0.2, 2));
  return model;
}

TEST(Schedule, AddsNodesWhereABoundIsExceeded) {
  const auto golden = test::golden_json("e_tune_structures.json").at("schedule");
  ScheduleOptions options = options_of(golden);
  const auto design = design_schedule(stiff_in_the_middle, kStroke, options);
  ASSERT_TRUE(design) << design.error().requirement;
  EXPECT_GT(design->schedule.nodes().size(), 3U);
  EXPECT_LE(design->margins.worst().exceeded(), options.room);
  // On a finer grid than the one that was looked at.
  EXPECT_LT(
      frozen_margins(stiff_in_the_middle, design->schedule, kStroke, options.bounds, 301).worst().exceeded(),
      1.5 * options.room);
  options.most_nodes = 3;
  EXPECT_EQ(design_schedule(stiff_in_the_middle, kStroke, options).error().field, "most_nodes");
}

/// Inertias and stiffness known to 2 %, the delay to 0.05 ms.
Posterior uncertain_belt_at(double position_m) {
  Eigen::VectorXd variances(5);
  variances << 4e-4, 4e-4, 4e-4, 4e-2, 2.5e-9;
  return {test::tooth_belt_at(position_m),
          {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping, fit::kDelay},
          variances.asDiagonal()};
}

TEST(Schedule, MeetsTheBoundsOnTheEllipsoidOfEveryPosition) {
  const auto golden = test::golden_json("e_tune_structures.json").at("schedule");
  ScheduleOptions options = options_of(golden);
  options.posterior_at = uncertain_belt_at;
  options.count = 13;
  const auto design = design_schedule(test::tooth_belt_at, kStroke, options);
  ASSERT_TRUE(design) << design.error().requirement;
  EXPECT_LE(design->margins.worst().exceeded(), options.room);
  const double nominal = golden.at("nodes")[0].at("ki")[0];
  EXPECT_LT(design->schedule.at(0.38).ki, 0.97 * nominal);
  EXPECT_GT(design->schedule.at(0.38).ki, 0.5 * nominal);
  const auto between = monte_carlo(uncertain_belt_at(0.9), design->schedule.at(0.9), options.bounds, 2000, 1);
  EXPECT_LT(between.probability(), 0.06);
  EXPECT_EQ(between.unstable, 0U);

  const auto one = one_for_all(test::tooth_belt_at, kStroke, options);
  ASSERT_TRUE(one) << one.error().requirement;
  EXPECT_LE(one->margins.worst().exceeded(), 1e-3);
  EXPECT_LT(one->schedule.at(0.38).ki, 0.97 * golden.at("one_pi_for_all").at("ki").get<double>());
}

TEST(Schedule, ARateOfChangeIsCheckedByRuns) {
  const auto golden = test::golden_json("e_tune_structures.json").at("schedule");
  ScheduleOptions options = options_of(golden);
  options.largest_speed = 1.0;
  const auto design = design_schedule(test::tooth_belt_at, kStroke, options);
  ASSERT_TRUE(design) << design.error().requirement;
  ASSERT_TRUE(design->rate);
  EXPECT_LT(design->rate->fast.iae, 1.1 * design->rate->slow.iae);
  EXPECT_FALSE((RateCheck{{1.2, 1.0}, {1.0, 1.0}}.is_met()));
  EXPECT_FALSE((RateCheck{{1.0, 1.2}, {1.0, 1.0}}.is_met()));
}

TEST(Schedule, InterpolatesMachinesByTheirLogarithms) {
  const auto at = machine_between({0.38, 1.65}, {test::tooth_belt_at(0.38), test::tooth_belt_at(1.65)});
  expect_near(at(0.38).parameters.stiffness, test::tooth_belt_at(0.38).parameters.stiffness, 1e-12);
  expect_near(at(9.0).parameters.stiffness, test::tooth_belt_at(1.65).parameters.stiffness, 1e-12);
  expect_near(at(1.015).parameters.stiffness,
              std::sqrt(test::tooth_belt_at(0.38).parameters.stiffness *
                        test::tooth_belt_at(1.65).parameters.stiffness),
              1e-12);
}

TEST(Schedule, RefusesWhatCannotBeDesigned) {
  ScheduleOptions options;
  EXPECT_EQ(design_schedule(test::tooth_belt_at, kStroke, options).error().field, "bounds");
  options.bounds.sensitivity = 1.4;
  EXPECT_EQ(design_schedule(test::tooth_belt_at, {1.0, 1.0}, options).error().field, "stroke");
  options.first_nodes = 1;
  EXPECT_EQ(one_for_all(test::tooth_belt_at, kStroke, options).error().field, "first_nodes");
}

}  // namespace
}  // namespace resonid::design
