// SPDX-License-Identifier: MIT
// Motion profiles with friction in the place of an excitation; the truth is that of the simulation.
#include <gtest/gtest.h>

#include <cmath>
#include <moving_axis.hpp>
#include <resonid/identification/identify.hpp>

namespace resonid {
namespace {

TEST(Motion, RigidAxesWithFrictionComeOutTrusted) {
  for (const double rate_hz : {500.0, 1000.0}) {
    test::MovingAxis machine;
    machine.rate_hz = rate_hz;
    machine.forth = 0.6;
    machine.back = 0.4;
    const auto record = test::simulated(machine, 7, data::OutputQuantity::velocity);
    identification::Options options;
    options.delay_s = test::told(machine).known_delay_s;
    const auto result = identification::identify(record, options);
    ASSERT_TRUE(result.has_value());
    EXPECT_TRUE(result->trusted);
    ASSERT_TRUE(result->model && result->model->coulomb_friction && result->model->offset);
    const auto& model = *result->model;
    EXPECT_EQ(model.drive.structure, fit::Structure::rigid);
    const auto expect = [](const data::Estimate& e, double truth) {
      EXPECT_NEAR(e.value, truth, 4.0 * e.std);
      EXPECT_LT(e.std, 0.02 * std::abs(truth));
    };
    expect(model.drive.estimate(fit::kDrivenInertia), machine.inertia);
    expect(model.drive.estimate(fit::kViscousFriction), machine.viscous);
    expect(*model.coulomb_friction, 0.5);
    expect(*model.offset, machine.offset - 0.1);
  }
}

/// Bearings may have hardly any dry friction: then the reference tells that the axis is led, not excited.
TEST(Motion, AnAxisLedByItsReferenceNeedsNoDryFriction) {
  test::MovingAxis machine;
  machine.forth = machine.back = 0.0;
  auto record = test::simulated(machine, 7, data::OutputQuantity::velocity);
  identification::Options options;
  options.delay_s = test::told(machine).known_delay_s;
  const auto result = identification::identify(record, options);
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->choices.front().chosen, "other");
  EXPECT_TRUE(result->trusted);
  ASSERT_TRUE(result->model.has_value());
  const auto inertia = result->model->drive.estimate(fit::kDrivenInertia);
  EXPECT_NEAR(inertia.value, machine.inertia, 4.0 * inertia.std);
  EXPECT_LT(inertia.std, 0.02 * machine.inertia);
  record.reference = {};
  const auto alone = identification::identify(record, options);
  ASSERT_TRUE(alone.has_value());
  EXPECT_NE(alone->choices.front().chosen, "other");
}

/// A channel that was recorded but never used is no excitation.
TEST(Motion, AnExcitationThatStaysAtRestIsNone) {
  const test::MovingAxis machine;
  auto record = test::simulated(machine, 7, data::OutputQuantity::velocity);
  record.excitation = {"ru", "Nm", std::vector<double>(record.samples(), 0.0)};
  const auto result = identification::identify(record, {});
  ASSERT_TRUE(result.has_value());
  ASSERT_TRUE(result->model.has_value());
  EXPECT_NEAR(result->model->drive.parameters.driven_inertia / machine.inertia, 1.0, 0.01);
}

}  // namespace
}  // namespace resonid
