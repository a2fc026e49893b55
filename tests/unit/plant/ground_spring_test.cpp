// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <resonid/plant/experiment.hpp>

#include "machines.hpp"

namespace resonid::plant {
namespace {

/// System 2 as a shaft: 143.75 Nm/rad, 0.3 Nms/rad.
DriveConfig held(double motor, double load) {
  DriveConfig c = test::system_2();
  c.load_inertia = 0.02;
  c.motor_ground_stiffness = motor;
  c.load_ground_stiffness = load;
  return c;
}

// det(K - w^2 M) = 0 by hand; with the motor clamped the load swings on both of its springs.
TEST(GroundSpring, ModesAreThoseOfTheCharacteristicPolynomial) {
  for (const auto& [motor, load] : {std::pair{40.0, 0.0}, {0.0, 25.0}, {40.0, 25.0}}) {
    const MassSystem system = mass_system(held(motor, load));
    const double k = 143.75, m1 = 0.032, m2 = 0.02;
    const double half = 0.5 * ((k + motor) / m1 + (k + load) / m2);
    const double product = ((k + motor) * (k + load) - k * k) / (m1 * m2);
    const double apart = std::sqrt(half * half - product);
    const auto modes = resonances(system);
    ASSERT_EQ(modes.size(), 2U);
    EXPECT_NEAR(modes[0].frequency_hz, std::sqrt(half - apart) / kTwoPi, 1e-10);
    EXPECT_NEAR(modes[1].frequency_hz, std::sqrt(half + apart) / kTwoPi, 1e-10);
    ASSERT_EQ(antiresonances(system).size(), 1U);
    EXPECT_NEAR(antiresonances(system)[0].frequency_hz, std::sqrt((k + load) / m2) / kTwoPi, 1e-10);
  }
  DriveConfig rigid = test::rigid();
  rigid.motor_ground_stiffness = 20.0;
  const auto modes = resonances(mass_system(rigid));
  ASSERT_EQ(modes.size(), 1U);
  EXPECT_NEAR(modes[0].frequency_hz, std::sqrt(20.0 / 0.05) / kTwoPi, 1e-12);
  EXPECT_NEAR(modes[0].damping_ratio, 0.07 / (2.0 * std::sqrt(20.0 * 0.05)), 1e-12);
  EXPECT_TRUE(antiresonances(mass_system(rigid)).empty());
}

// Let go beside its rest without damping, a rigid machine swings as a cosine, whatever the sample time.
TEST(GroundSpring, RigidMachineSwingsAsItsFormulaSays) {
  DriveConfig config = test::rigid();
  config.viscous_friction = 0.0;
  config.motor_ground_stiffness = 20.0;
  for (const double rate : {20.0, 1000.0}) {
    const auto drive = make_drive({config, {}, {}, 0.0}, rate, 0.0).value();
    EXPECT_TRUE(drive->grounded());
    EXPECT_NEAR(drive->settle(0.0, 0.3), 6.0, 1e-14);
    for (int k = 1; k < 2000; ++k) {
      const MassMotion m = drive->advance(0.0);
      ASSERT_NEAR(m.angle, 0.3 * std::cos(20.0 * k / rate), 1e-11);
      ASSERT_NEAR(m.velocity, -6.0 * std::sin(20.0 * k / rate), 1e-9);
    }
  }
}

// Coulomb friction Tc takes 4 Tc/k off the swing in every period, until the spring no longer moves it.
TEST(GroundSpring, DryFrictionStopsTheSwingAsItsFormulaSays) {
  DriveConfig config = test::rigid();
  config.viscous_friction = 0.0;
  config.motor_ground_stiffness = 20.0;
  const auto drive = make_drive({config, {{0.4, 0.0, 0.0}, {}}, {}, 0.0}, 300.0, 0.0).value();
  drive->settle(0.0, 0.31);
  double at = 0.31;
  int swings = 0;
  for (; std::abs(at) > 0.4 / 20.0; ++swings) at = std::copysign(2.0 * 0.4 / 20.0, at) - at;
  for (int k = 0; k < 3000; ++k) drive->advance(0.0);
  EXPECT_EQ(swings, 8);
  EXPECT_EQ(drive->motions()[0].velocity, 0.0);
  EXPECT_NEAR(drive->motions()[0].angle, at, 1e-12);
}

// Without an integrator spring and load balance where the controller gives nothing; with one where the motion
// begins. Either way nothing moves.
TEST(GroundSpring, LoopStartsWhereItBalances) {
  test::LoopConfig c;
  c.machine.drive = held(10.0, 25.0);
  c.machine.disturbance.load_torque = 0.7;
  c.delay_s = 0.0027;
  c.motion.from = 0.2;
  for (const auto kind :
       {ControllerKind::p, ControllerKind::pi, ControllerKind::cascade, ControllerKind::none}) {
    c.controller = test::pi_controller(0.5, 0.1);
    c.controller.kind = kind;
    c.controller.position_gain = 3.0;
    // P: u = 0, and 10 a + K (a - b) = 0, K (a - b) = 25 b - 0.7 of motor and load angles a and b.
    const double k = 143.75;
    const double balanced = k * 0.7 / ((10.0 + k) * (25.0 + k) - k * k);
    const double place = kind == ControllerKind::p ? balanced : 0.2;
    auto loop = test::make_loop(c);
    for (int i = 0; i < 500; ++i) {
      const auto s = loop.step(0.0, 0.0);
      ASSERT_NEAR(s.output, 0.0, 1e-11) << name_of(kind);
      ASSERT_NEAR(s.place, place, 1e-12) << name_of(kind);
    }
  }
}

TEST(GroundSpring, ConstantMotionAgainstASpringIsRefused) {
  ExperimentConfig c;
  c.drive = held(10.0, 0.0);
  c.controller = test::pi_controller(0.5, 0.1);
  c.motion.kind = MotionKind::constant;
  c.motion.velocity = 3.0;
  c.run = {500.0, 1.0, 1};
  EXPECT_EQ(std::string(check(c).error().field), "motion.velocity");
  c.drive.motor_ground_stiffness = 0.0;
  EXPECT_TRUE(check(c).has_value());
  c.drive.motor_ground_stiffness = -1.0;
  EXPECT_EQ(std::string(check(c).error().field), "drive.motor_ground_stiffness");
}

}  // namespace
}  // namespace resonid::plant
