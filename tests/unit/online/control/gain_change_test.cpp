// SPDX-License-Identifier: MIT
// Other gains in motion, and gains over position: no jump of the torque.
#include <gtest/gtest.h>

#include <resonid/online/control.hpp>

#include "direct_law.hpp"

namespace resonid::online {
namespace {

using test::filtered_config;
using test::kRate;
using test::plain_config;
using test::velocity_inputs;

/// Under a constant error and without ki a PI is a constant: nothing else than a jump could be seen.
TEST(GainChange, AnotherKpMakesNoJump) {
  DriveControlConfig config = filtered_config();
  config.ki = 0.0;
  config.set_point_weight = 0.3;
  auto control = DriveControl<double>::create(config).value(), plain = control;
  for (int k = 0; k < 600; ++k) {
    if (k == 300) {
      ASSERT_TRUE(control.set_gains(7.0, 0.0));
    }
    if (k == 320) {
      ASSERT_TRUE(control.set_gains(0.01, 0.0));
    }
    EXPECT_NEAR(control.step(velocity_inputs<double>(10.0, -4.0)),
                plain.step(velocity_inputs<double>(10.0, -4.0)), 1e-12)
        << k;
  }
  EXPECT_EQ(control.kp(), 0.01);
}

/// Another ki: from the very sample on the sum grows by ki Ts e, and by nothing else.
TEST(GainChange, AnotherKiMakesNoJump) {
  auto control = DriveControl<double>::create(plain_config()).value();
  double before = 0.0;
  for (int k = 0; k < 200; ++k) {
    if (k == 100) {
      ASSERT_TRUE(control.set_gains(0.6, 400.0));
    }
    const double torque = control.step(velocity_inputs<double>(2.0, 1.5));
    if (k > 0) {
      EXPECT_NEAR(torque - before, (k < 100 ? 25.0 : 400.0) / kRate * 0.5, 1e-12) << k;
    }
    before = torque;
  }
}

TEST(GainChange, GainsThatAreNoneAreRefusedAndChangeNothing) {
  auto control = DriveControl<double>::create(plain_config()).value();
  EXPECT_EQ(control.set_gains(-1.0, 2.0).error().field, "kp");
  EXPECT_EQ(control.set_gains(1.0, INFINITY).error().field, "ki");
  EXPECT_EQ(control.set_schedule({}).error().field, "schedule");
  EXPECT_EQ(control.kp(), 0.6);
}

constexpr std::array<GainNode, 3> kNodes{{{0.0, 0.5, 0.0}, {1.0, 3.0, 0.0}, {1.5, 1.0, 0.0}}};

ControlInputs<double> at(double position, double reference, double velocity) {
  return {.reference = reference, .velocity = velocity, .position = position};
}

/// A run through the stroke, and a position that jumps over it: with ki = 0 the torque stays, at a constant
/// error.
TEST(GainSchedule, MakesNoJumpWhereverThePositionGoes) {
  DriveControlConfig config = plain_config();
  config.kp = config.ki = 0.0;
  config.schedule = kNodes;
  auto control = DriveControl<double>::create(config).value();
  double first = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const double position = k < 2000 ? 0.001 * k : k % 2 == 0 ? 0.1 : 1.2;
    const double torque = control.step(at(position, 5.0, 1.0));
    if (k == 0) first = torque;
    EXPECT_NEAR(torque, first, 1e-12) << k;
  }
  EXPECT_NEAR(first, 0.5 * 4.0, 1e-15);
}

/// The velocity form of the same law, worked out here: du = kp(x) d(b r - y) + ki(x) Ts e.
TEST(GainSchedule, IsTheVelocityForm) {
  constexpr std::array<GainNode, 2> kGains{{{0.0, 0.5, 5.0}, {1.0, 3.0, 60.0}}};
  DriveControlConfig config = plain_config();
  config.kp = config.ki = 0.0;
  config.set_point_weight = 0.6;
  config.schedule = kGains;
  auto control = DriveControl<double>::create(config).value();
  test::Noise noise(21);
  double u = 0.0, before = 0.0;
  for (int k = 0; k < 2000; ++k) {
    const double x = 0.5 + 0.7 * std::sin(0.01 * k), y = noise(), r = k < 900 ? 1.0 : -2.0;
    const double share = std::clamp(x, 0.0, 1.0), deviation = 0.6 * r - y;
    u += (0.5 + 2.5 * share) * (deviation - before) + (5.0 + 55.0 * share) / kRate * (r - y);
    before = deviation;
    EXPECT_NEAR(control.step(at(x, r, y)), u, 1e-11) << k;
  }
}

TEST(GainSchedule, ComesAndGoesWithoutAJump) {
  DriveControlConfig config = filtered_config();
  config.ki = 0.0;
  auto control = DriveControl<double>::create(config).value(), plain = control;
  for (int k = 0; k < 400; ++k) {
    if (k == 100) {
      ASSERT_TRUE(control.set_schedule(kNodes));
    }
    if (k == 300) {
      ASSERT_TRUE(control.set_gains(2.0, 0.0));
    }
    EXPECT_NEAR(control.step(at(0.01 * k, 3.0, 1.0)), plain.step(at(0.0, 3.0, 1.0)), 1e-12) << k;
  }
  EXPECT_EQ(control.kp(), 2.0);
}

/// One absurd sample behind a torque limit leaves no trace in the sum, though the gains change meanwhile.
TEST(GainSchedule, ASpikeDoesNotReachTheSum) {
  DriveControlConfig config = plain_config();
  config.kp = config.ki = 0.0;
  config.schedule = kNodes;
  config.torque_limit = 20.0;
  auto control = DriveControl<double>::create(config).value(), plain = control;
  for (int k = 0; k < 500; ++k) {
    const double torque = control.step(at(0.002 * k, 1.0, k == 250 ? 1e12 : 0.5));
    const double undisturbed = plain.step(at(0.002 * k, 1.0, 0.5));
    if (k == 250) {
      EXPECT_EQ(torque, -20.0);
    } else {
      EXPECT_NEAR(torque, undisturbed, 0.02) << k;
    }
  }
}

}  // namespace
}  // namespace resonid::online
