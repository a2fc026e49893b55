// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <allocation_counter.hpp>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/plant/experiment.hpp>

#include "machines.hpp"

namespace resonid::plant {
namespace {

using test::LoopConfig;

// A rigid machine without friction and an incremental PI of one's own: u(k) = limit(u(k-1) + Kp (e(k) -
// e(k-1)) + Kp Ts/Ti e(k)), which cannot wind up.
TEST(LoopLimits, LimitedTorqueIsThatOfAnIncrementalController) {
  LoopConfig c;
  c.machine.drive = test::rigid();
  c.machine.drive.viscous_friction = 0.0;
  c.controller = test::pi_controller(0.8, 0.1);
  c.controller.torque_limit = 1.0;
  c.delay_s = 0.002;
  auto loop = test::make_loop(c);
  double velocity[2] = {0.0, 0.0};  // now, and one sample ago
  double last_error = 0.0;
  double command = 0.0;
  int limited = 0;
  for (int k = 0; k < 3000; ++k) {
    const double ru = k < 400 ? 3.0 : 1.6 * std::sin(0.05 * k);
    const auto s = loop.step(ru, 0.0);
    const double error = -velocity[1];
    ASSERT_NEAR(s.output, velocity[1], 1e-11) << k;
    const double wanted = command + 0.8 * (error - last_error) + 0.8 * 0.002 / 0.1 * error + ru;
    const double u = std::clamp(wanted, -1.0, 1.0);
    ASSERT_NEAR(s.input, u, 1e-11) << k;
    if (u != wanted) ++limited;
    command = u - ru;
    last_error = error;
    velocity[1] = velocity[0];
    velocity[0] += 0.002 / 0.05 * u;
  }
  EXPECT_GT(limited, 500);
}

TEST(LoopLimits, VelocityReferenceIsLimited) {
  LoopConfig c;
  c.machine.drive = test::system_2();
  c.machine.drive.viscous_friction = 0.03;
  c.controller = test::pi_controller(1.0, 0.15);
  c.controller.velocity_limit = 6.0;
  c.delay_s = 0.004;
  c.motion.kind = MotionKind::constant;
  c.motion.velocity = 10.0;
  auto loop = test::make_loop(c);
  for (int k = 0; k < 500; ++k) {
    const auto s = loop.step(0.0, 0.0);
    ASSERT_NEAR(s.output, 6.0, 1e-10);
    ASSERT_NEAR(s.input, 0.18, 1e-10);
  }
}

LoopConfig cascade(double feedforward) {
  LoopConfig c;
  c.machine.drive = test::system_2();
  c.machine.drive.viscous_friction = 0.01;
  c.controller = test::pi_controller(1.0, 0.15);
  c.controller.kind = ControllerKind::cascade;
  c.controller.position_gain = 4.0;
  c.controller.velocity_feedforward = feedforward;
  c.delay_s = 0.0047;
  c.motion.velocity = 5.0;
  c.motion.acceleration = 40.0;
  c.motion.jerk = 800.0;
  c.motion.from = -2.0;
  c.motion.to = 28.0;
  c.motion.wait_s = 0.2;
  return c;
}

// In the steady part of a move v = kp (p* - p(t - Td)) + ff v: the machine lies (1 - ff) v/kp - v Td behind.
TEST(LoopLimits, CascadeFollowsWithTheSteadyError) {
  for (const MotionKind kind : {MotionKind::trapezoidal, MotionKind::s_curve})
    for (const double feedforward : {0.0, 0.5, 1.0}) {
      LoopConfig c = cascade(feedforward);
      c.motion.kind = kind;
      const auto profile = MotionProfile::create(c.motion).value();
      auto loop = test::make_loop(c);
      for (int k = 0; k < 6500; ++k) {
        const double t = k / c.sample_rate_hz;
        const auto s = loop.step(0.0, 0.0);
        if (t < 0.2) {
          ASSERT_NEAR(s.place, -2.0, 1e-12);
        }
        if (t > 5.5 && t < 6.1) {
          ASSERT_NEAR(profile.at(t).velocity, 5.0, 1e-12);
          ASSERT_NEAR(profile.at(t).position - s.place, (1.0 - feedforward) * 5.0 / 4.0 - 5.0 * 0.0047, 1e-6);
        }
        if (t > 12.5) {
          ASSERT_NEAR(s.place, 28.0, 1e-6);
        }
      }
    }
}

TEST(LoopLimits, CascadeStartsSettledOnTheRun) {
  LoopConfig c = cascade(0.5);
  c.motion.kind = MotionKind::constant;
  const auto profile = MotionProfile::create(c.motion).value();
  auto loop = test::make_loop(c);
  for (int k = 0; k < 2000; ++k) {
    const auto s = loop.step(0.0, 0.0);
    ASSERT_NEAR(s.output, 5.0, 1e-9);
    ASSERT_NEAR(profile.at(k / c.sample_rate_hz).position - s.place, 0.5 * 5.0 / 4.0 - 5.0 * 0.0047, 1e-9);
  }
}

/// Torque of the whole machine fed forward, with friction that it knows.
LoopConfig fed_forward() {
  LoopConfig c = cascade(1.0);
  c.machine.friction.driven = {0.3, 0.3, 0.0};
  c.controller.acceleration_feedforward = 0.064;
  c.controller.viscous_feedforward = 0.01;
  c.controller.coulomb_feedforward = 0.3;
  c.controller.reference_delay_s = 0.0047;
  return c;
}

TEST(LoopLimits, TorqueFeedForwardStartsSettledOnTheRun) {
  LoopConfig c = fed_forward();
  c.motion.kind = MotionKind::constant;
  const auto profile = MotionProfile::create(c.motion).value();
  auto loop = test::make_loop(c);
  for (int k = 0; k < 2000; ++k) {
    const auto s = loop.step(0.0, 0.0);
    ASSERT_NEAR(s.output, 5.0, 1e-9);
    ASSERT_NEAR(s.input, 0.01 * 5.0 + 0.3, 1e-9);
    // What is compared is as late as what is measured, so that nothing is left of the delay.
    ASSERT_NEAR(profile.at(k / c.sample_rate_hz).position - s.place, 0.0, 1e-9);
  }
}

/// Largest distance of the driven side from its profile.
double farthest_off(const LoopConfig& c) {
  const auto profile = MotionProfile::create(c.motion).value();
  auto loop = test::make_loop(c);
  double farthest = 0.0;
  for (int k = 0; k < 3750; ++k)
    farthest =
        std::max(farthest, std::abs(profile.at(k / c.sample_rate_hz).position - loop.step(0.0, 0.0).place));
  return farthest;
}

TEST(LoopLimits, TorqueFeedForwardLeavesLittleToFeedback) {
  LoopConfig c = fed_forward();
  c.motion.kind = MotionKind::s_curve;
  const double all = farthest_off(c);
  c.controller.coulomb_feedforward = 0.0;
  const double without_friction = farthest_off(c);
  c.controller.acceleration_feedforward = c.controller.viscous_feedforward = 0.0;
  const double velocity_alone = farthest_off(c);
  EXPECT_LT(all, 0.6 * without_friction);
  EXPECT_LT(all, 0.2 * velocity_alone);
}

// A rigid machine without friction under a cascade of one's own, whose feed-forward asks for more than the
// limit: both together are limited, and the law goes on from its own part of what was given.
TEST(LoopLimits, TorqueFeedForwardIsLimitedWithTheController) {
  LoopConfig c;
  c.machine.drive = test::rigid();
  c.machine.drive.viscous_friction = 0.0;
  c.controller = test::pi_controller(0.8, 0.1);
  c.controller.kind = ControllerKind::cascade;
  c.controller.position_gain = 4.0;
  c.controller.velocity_feedforward = 1.0;
  c.controller.acceleration_feedforward = 0.05;
  c.controller.viscous_feedforward = 0.02;
  c.controller.coulomb_feedforward = 0.3;
  c.controller.reference_delay_s = 0.004;
  c.controller.torque_limit = 2.0;
  c.motion.kind = MotionKind::trapezoidal;
  c.motion.velocity = 4.0;
  c.motion.acceleration = 60.0;  // 3 Nm
  c.motion.to = 3.0;
  c.motion.wait_s = 0.1;
  const auto profile = MotionProfile::create(c.motion).value();
  auto loop = test::make_loop(c);
  double velocity = 0.0, place = 0.0, command = 0.0, last_error = 0.0;
  int limited = 0;
  for (int k = 0; k < 1500; ++k) {
    const double ru = 0.2 * std::sin(0.05 * k);
    const auto s = loop.step(ru, 0.0);
    const Setpoint now = profile.at(k * 0.002), compared = profile.at(k * 0.002 - 0.004);
    ASSERT_NEAR(s.place, place, 1e-9) << k;
    ASSERT_NEAR(s.reference, compared.velocity, 1e-12) << k;
    const double error = 4.0 * (compared.position - place) + compared.velocity - velocity;
    const double fed = 0.05 * now.acceleration + 0.02 * now.velocity + (now.velocity > 0.0 ? 0.3 : 0.0);
    const double wanted = command + 0.8 * (error - last_error) + 0.8 * 0.002 / 0.1 * error + fed + ru;
    const double u = std::clamp(wanted, -2.0, 2.0);
    ASSERT_NEAR(s.input, u, 1e-8) << k;
    if (u != wanted) ++limited;
    command = u - fed - ru;
    last_error = error;
    place += 0.002 * (velocity + 0.5 * 0.002 / 0.05 * u);
    velocity += 0.002 / 0.05 * u;
  }
  EXPECT_GT(limited, 30);
  EXPECT_NEAR(place, 3.0, 0.05);
}

// A proportional controller gives way to a load: v = -T/(Kp + b); friction that can hold it does.
TEST(LoopLimits, ProportionalControllerStartsSettledUnderALoad) {
  LoopConfig c;
  c.machine.drive = test::system_2();
  c.machine.drive.viscous_friction = 0.1;
  c.machine.disturbance.load_torque = 0.6;
  c.controller.kind = ControllerKind::p;
  c.controller.gain = 0.5;
  auto loop = test::make_loop(c);
  for (int k = 0; k < 200; ++k) ASSERT_NEAR(loop.step(0.0, 0.0).output, 1.0, 1e-11);
  c.machine.friction.driven = {0.2, 0.3, 0.0};
  auto sliding = test::make_loop(c);
  for (int k = 0; k < 200; ++k) ASSERT_NEAR(sliding.step(0.0, 0.0).output, 0.4 / 0.6, 1e-11);
  c.machine.friction.driven = {0.7, 0.7, 0.0};
  auto held = test::make_loop(c);
  for (int k = 0; k < 200; ++k) ASSERT_EQ(held.step(0.0, 0.0).output, 0.0);
}

ExperimentConfig belt_experiment() {
  ExperimentConfig c;
  c.drive = test::tooth_belt();
  c.motion.from = 1.6;
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 4;
  c.excitation.clock_divider = 50;
  c.run = {500.0, 20.0, 1};
  return c;
}

TEST(LoopLimits, CartThatLeavesItsStrokeIsAnError) {
  const auto result = simulate_closed_loop(belt_experiment());
  ASSERT_FALSE(result.has_value());
  EXPECT_EQ(result.error().field, "drive.stroke_from_m");
  EXPECT_NE(result.error().requirement.view().find("leaves its stroke, 0.1 ... 1.69 m"), std::string::npos)
      << message_of(result.error());
  ExperimentConfig run = belt_experiment();
  run.motion.kind = MotionKind::constant;
  run.motion.velocity = 0.38;
  const auto refused = check(run);
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().field, "motion.velocity");
}

TEST(LoopLimits, RigidMachineRefusesWhatNeedsACoupling) {
  const auto field = [](auto change) {
    MachineConfig machine;
    machine.drive = test::rigid();
    change(machine);
    return std::string(make_drive(machine, 500.0, 0.0).error().field);
  };
  EXPECT_EQ(field([](auto& m) { m.disturbance.eccentricity = 0.1; }), "eccentricity");
  EXPECT_EQ(field([](auto& m) { m.disturbance.loosening = 0.1; }), "loosening");
  EXPECT_EQ(field([](auto& m) { m.disturbance.stiffness_drift_per_s = 0.1; }), "stiffness_drift_per_s");
  EXPECT_EQ(field([](auto& m) { m.friction.load.coulomb = 0.1; }), "load_coulomb");
}

TEST(LoopLimits, SameSeedSameSamplesAndLength) {
  ExperimentConfig c = belt_experiment();
  c.controller = test::pi_controller(0.12, 0.2);
  c.friction.driven = {0.2, 0.3, 0.5};
  c.measurement.noise_rms = 0.1;
  c.measurement.noise_bandwidth_hz = 50.0;
  c.measurement.velocity = VelocitySource::encoder;
  c.measurement.encoder_counts = 8192.0;
  c.motion.from = 1.0;
  c.run.duration_s = 1.2345;
  const auto one = simulate_closed_loop(c);
  const auto two = simulate_closed_loop(c);
  ASSERT_TRUE(one.has_value()) << message_of(one.error());
  EXPECT_EQ(one->record.samples(), 617U);  // 1.2345 s at 500 Hz, rounded
  EXPECT_EQ(one->record.output.samples, two->record.output.samples);
  EXPECT_EQ(one->record.input.samples, two->record.input.samples);
  EXPECT_EQ(one->record.position.samples, two->record.position.samples);
  c.run.seed = 2;
  EXPECT_NE(one->record.output.samples, simulate_closed_loop(c)->record.output.samples);
}

TEST(LoopLimits, StepTakesNoMemory) {
  LoopConfig linear;
  linear.machine.drive = test::system_2();
  linear.controller = test::pi_controller(1.0, 0.15);
  linear.delay_s = 0.0047;
  LoopConfig belt = cascade(1.0);
  belt.machine = {test::tooth_belt(), {{0.3, 0.4, 0.5}, {0.1, 0.2, 0.5}}, {}, 0.001};
  belt.machine.disturbance.eccentricity = 1e-5;
  belt.machine.disturbance.load_step = {1.0};
  belt.machine.disturbance.load_step_at_s = {0.5};
  belt.sample_rate_hz = 2000.0;
  belt.controller.gain = 0.12;
  belt.controller.torque_limit = 5.0;
  belt.motion.kind = MotionKind::trapezoidal;
  belt.motion.velocity = 0.5;
  belt.motion.acceleration = 3.0;
  belt.motion.from = 0.4;
  belt.motion.to = 0.9;
  belt.motion.returns = true;
  belt.velocity = VelocitySource::encoder;
  belt.count = kTwoPi / 8192.0;
  for (const LoopConfig& config : {linear, belt}) {
    auto loop = test::make_loop(config);
    const std::size_t before = resonid::test::allocations();
    for (int k = 0; k < 8000; ++k) loop.step(std::sin(0.2 * k), 0.0);
    EXPECT_EQ(resonid::test::allocations(), before);
  }
}

}  // namespace
}  // namespace resonid::plant
