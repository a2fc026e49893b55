// SPDX-License-Identifier: MIT
// Steps of the weighted reference against an independent implementation
// (tests/golden/e_tune_structures.json).
#include <gtest/gtest.h>

#include <cmath>

#include "design/setpoint.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

TEST(GoldenSetpoint, Steps) {
  const auto golden = test::golden_json("e_tune_structures.json");
  const auto& cases = golden.at("setpoint").at("cases");
  ASSERT_EQ(cases.size(), 27U);
  for (const auto& c : cases) {
    SCOPED_TRACE(c.dump());
    const Machine machine = test::golden_plant(golden, c.at("plant"));
    const auto step = setpoint_step_of(machine, {c.at("kp"), c.at("ki"), {}}, c.at("weight"));
    EXPECT_NEAR(step.overshoot, c.at("overshoot").get<double>(), 1e-5);
    EXPECT_NEAR(step.settling_s, c.at("settling_2_percent_s").get<double>(), 1.001 * machine.sample_time_s());
    EXPECT_NEAR(step.peak_torque / c.at("peak_torque").get<double>(), 1.0, 1e-5);
    EXPECT_NEAR(step.rms_torque_1s / c.at("rms_torque_1s").get<double>(), 1.0, 1e-5);
  }
}

TEST(LargestWeight, ReachesTheOvershootThatIsAllowed) {
  const auto golden = test::golden_json("e_tune_structures.json");
  const Machine machine = test::golden_plant(golden, "system2");
  const FilteredPi calm{2.112725983, 21.52729938, {}};
  const auto weight = largest_weight(machine, calm, 0.05);
  ASSERT_TRUE(weight);
  EXPECT_GT(*weight, 0.5);  // which leaves 0.2 %
  EXPECT_LT(*weight, 1.0);
  EXPECT_NEAR(setpoint_step_of(machine, calm, *weight).overshoot, 0.05, 1e-6);
  EXPECT_EQ(largest_weight(machine, calm, 0.3), 1.0);
  // The loop without a bound on the load overshoots by a quarter without any weight.
  EXPECT_EQ(largest_weight(machine, {1.829183248, 49.24622553, {}}, 0.1), 0.0);
  EXPECT_FALSE(largest_weight(machine, {30.0, 1.0, {}}, 0.1));
}

TEST(LargestWeight, WorksThroughAFilter) {
  const auto golden = test::golden_json("e_tune_structures.json");
  const Machine machine = test::golden_plant(golden, "system2");
  const FilteredPi controller{2.0, 20.0, {{15.0, 0.3, 0.6}}};
  // A weight of 1 is the loop of the error alone: no more than what the filter lets through at once.
  const auto first = controller.transfer_function(machine.sample_time_s()).numerator.front();
  EXPECT_GE(setpoint_step_of(machine, controller, 1.0).peak_torque, first * (1.0 - 1e-12));
  EXPECT_LT(setpoint_step_of(machine, controller, 0.0).peak_torque, first);
}

}  // namespace
}  // namespace resonid::design
