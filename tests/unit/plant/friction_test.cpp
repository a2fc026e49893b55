// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>

#include "machines.hpp"

namespace resonid::plant {
namespace {

/// Kinetic and elastic energy of a machine whose stiffness stays.
double energy(const MassSystem& system, const Drive& drive) {
  const auto motions = drive.motions();
  double sum = 0.0;
  for (std::size_t i = 0; i < system.masses(); ++i)
    sum += 0.5 * system.inertia[i] * motions[i].velocity * motions[i].velocity;
  for (const Coupling& c : system.couplings) {
    const double twist = motions[c.from].angle - motions[c.to].angle;
    sum += 0.5 * c.stiffness * twist * twist;
  }
  return sum;
}

/// Of energy(): twists are differences of angles that may be large.
double rounding(const MassSystem& system, const Drive& drive) {
  const auto motions = drive.motions();
  double sum = 0.0;
  for (const Coupling& c : system.couplings) {
    const double lost = 4.0 * std::numeric_limits<double>::epsilon() *
                        (std::abs(motions[c.from].angle) + std::abs(motions[c.to].angle));
    sum += c.stiffness * (std::abs(motions[c.from].angle - motions[c.to].angle) + lost) * lost;
  }
  return sum;
}

MachineConfig with_friction(const DriveConfig& drive, DryFriction driven, DryFriction load = {}) {
  return {drive, {driven, load}, {}, 0.0};
}

TEST(Friction, HoldsAtStandstill) {
  for (const DriveConfig& config : {test::system_2(), test::chain(4), test::chain(1), test::tooth_belt()}) {
    const auto drive = make_drive(with_friction(config, {0.4, 0.5, 0.1}), 1000.0, 0.25).value();
    drive->settle(0.0, 0.7);
    const double start = drive->motions()[0].angle;
    for (int k = 0; k < 200000; ++k) {  // 200 s of a torque that comes up to the breakaway torque
      const MassMotion motion = drive->advance(0.5 * std::sin(0.01 * k));
      ASSERT_EQ(motion.velocity, 0.0) << k;
      ASSERT_EQ(motion.angle, start) << k;
    }
    for (const MassMotion& m : drive->motions()) EXPECT_EQ(m.velocity, 0.0);
  }
}

TEST(Friction, BreaksAwayAtItsTorque) {
  const auto first_motion = [](const MachineConfig& machine) {
    const auto drive = make_drive(machine, 1000.0, 0.0).value();
    drive->settle(0.0, 0.7);
    for (int k = 0;; ++k)
      if (drive->advance(1e-4 * k).velocity != 0.0) return 1e-4 * k;
  };
  EXPECT_NEAR(first_motion(with_friction(test::system_2(), {0.4, 0.5, 0.1})), 0.5, 1.01e-4);
  EXPECT_NEAR(first_motion(with_friction(test::system_2(), {0.4, 0.0, 0.0})), 0.4, 1.01e-4);
  EXPECT_NEAR(first_motion(with_friction(test::chain(1), {0.0, 0.3, 0.1})), 0.3, 1.01e-4);
  // A load torque helps, through the coupling that it has twisted.
  MachineConfig loaded = with_friction(test::system_2(), {0.4, 0.5, 0.1});
  loaded.disturbance.load_torque = 0.2;
  const auto drive = make_drive(loaded, 1000.0, 0.0).value();
  EXPECT_NEAR(drive->settle(0.0, 0.0), -0.2, 1e-12);
  for (int k = 0; k < 1000; ++k) ASSERT_EQ(drive->advance(0.299).velocity, 0.0);
  EXPECT_GT(drive->advance(0.301).velocity, 0.0);
}

// The load's friction: torque on the motor winds the coupling up, the load stays until the spring exceeds it.
TEST(Friction, LoadStaysUntilTheCouplingBreaksItAway) {
  const auto drive = make_drive(with_friction(test::system_2(), {}, {0.4, 0.5, 0.1}), 1000.0, 0.0).value();
  drive->settle(0.0, 0.0);
  double twist = 0.0;
  for (int k = 0;; ++k) {
    drive->advance(1e-5 * k);
    const auto motions = drive->motions();
    if (motions[1].velocity != 0.0) break;
    ASSERT_NEAR(motions[1].angle, 0.0, 1e-15);
    twist = motions[0].angle;
    ASSERT_LT(k, 200000);
  }
  EXPECT_NEAR(143.75 * twist, 0.5, 1e-4);
}

// Both sides stick with the coupling wound up, and hold it for ever.
TEST(Friction, BothSidesMayRestWithAWoundUpCoupling) {
  const auto drive =
      make_drive(with_friction(test::system_2(), {0.4, 0.6, 0.1}, {0.4, 0.6, 0.1}), 500.0, 0.0).value();
  drive->settle(0.0, 0.0);
  for (int k = 0; k < 2000; ++k) drive->advance(0.85);
  for (int k = 0; k < 2000; ++k) drive->advance(0.0);
  const auto rest = drive->motions();
  EXPECT_EQ(rest[0].velocity, 0.0);
  EXPECT_EQ(rest[1].velocity, 0.0);
  EXPECT_NE(rest[0].angle, rest[1].angle);
  for (int k = 0; k < 20000; ++k) drive->advance(0.0);
  EXPECT_EQ(drive->motions()[0].angle, rest[0].angle);
  EXPECT_EQ(drive->motions()[1].angle, rest[1].angle);
}

// A rigid machine slows down at Tc/J, and stops after J v0/Tc on the way J v0^2/(2 Tc). With a torque loop
// that is too fast for a polynomial it comes to rest up to 1/4096 of a sample early.
TEST(Friction, StopsARigidMachineWhereItsFormulaSays) {
  DriveConfig rigid = test::rigid();
  rigid.viscous_friction = 0.0;
  for (const double lag_s : {0.0, 1e-7})
    for (const double rate : {20.0, 300.0, 5000.0}) {
      MachineConfig machine = with_friction(rigid, {0.4, 0.6, 0.0});
      machine.torque_lag_s = lag_s;
      const auto drive = make_drive(machine, rate, 0.0).value();
      drive->settle(10.0, 0.0);
      // The torque loop still holds the friction's 0.4 Nm when the command falls to 0.
      const double held = 0.4 * lag_s / 0.05;
      const double early = lag_s > 0.0 ? 1.0 / rate / 4096.0 : 0.0;
      const double stop_s = 1.25 + held / 8.0;
      for (int k = 1; k <= static_cast<int>(3.0 * rate); ++k) {
        const double t = k / rate;
        const MassMotion m = drive->advance(0.0);
        ASSERT_NEAR(m.velocity, std::max(0.0, 10.0 + held - 8.0 * t), 1e-11) << rate << " " << t;
        const double angle = t < stop_s ? (10.0 + held) * t - 4.0 * t * t : 4.0 * stop_s * stop_s;
        ASSERT_NEAR(m.angle, angle, 1e-10 + held * lag_s + 4.0 * early * early) << rate << " " << t;
      }
    }
}

// The way of each direction: forwards J v0^2/(2 Tc+), backwards J v0^2/(2 Tc-).
TEST(Friction, StopsARigidMachineByTheFrictionOfItsDirection) {
  DriveConfig rigid = test::rigid();
  rigid.viscous_friction = 0.0;
  for (const auto& [velocity, coulomb] : {std::pair{10.0, 0.4}, {-10.0, 0.65}}) {
    const auto drive = make_drive(with_friction(rigid, {0.4, 0.0, 0.0, 0.65}), 300.0, 0.0).value();
    EXPECT_NEAR(drive->settle(velocity, 0.0), std::copysign(coulomb, velocity), 1e-14);
    for (int k = 1; k <= 600; ++k) drive->advance(0.0);
    EXPECT_EQ(drive->motions()[0].velocity, 0.0);
    EXPECT_NEAR(drive->motions()[0].angle, std::copysign(0.05 * 50.0 / coulomb, velocity), 1e-10);
    for (int k = 0; k < 100; ++k) drive->advance(velocity > 0.0 ? 0.399 : -0.649);
    EXPECT_EQ(drive->motions()[0].velocity, 0.0);
    for (int k = 0; k < 100; ++k) drive->advance(velocity > 0.0 ? 0.401 : -0.651);
    EXPECT_GT(drive->motions()[0].velocity * velocity, 0.0);
  }
}

// Free motion of any machine, at any sample time: energy never rises.
RC_GTEST_PROP(Friction, EnergyNeverRises, ()) {
  const auto number = [](double low, double high) {
    return low + (high - low) * 1e-4 * *rc::gen::inRange(0, 10001);
  };
  const auto masses = *rc::gen::inRange<std::size_t>(1, 5);
  DriveConfig config;
  config.structure = Structure::chain;
  for (std::size_t i = 0; i < masses; ++i) {
    config.inertias.push_back(number(0.003, 0.1));
    if (i + 1 == masses) break;
    config.stiffnesses.push_back(number(10.0, 1000.0));
    config.dampings.push_back(*rc::gen::arbitrary<bool>() ? 0.0 : number(0.0, 0.5));
  }
  const auto friction = [&] {
    DryFriction f;
    f.coulomb = number(0.02, 2.0);
    f.breakaway = number(0.0, 3.0);
    f.stribeck_velocity = *rc::gen::arbitrary<bool>() ? 0.0 : number(0.0, 2.0);
    f.coulomb_negative = *rc::gen::arbitrary<bool>() ? 0.0 : number(0.02, 2.0);
    return f;
  };
  MachineConfig machine{config, {friction(), masses > 1 ? friction() : DryFriction{}}, {}, 0.0};
  if (*rc::gen::arbitrary<bool>()) machine.drive.viscous_friction = number(0.0, 0.1);
  const double rate = std::pow(10.0, number(1.3, 3.7));  // 20 ... 5000 Hz, far below the resonances too
  const double fraction = *rc::gen::arbitrary<bool>() ? 0.0 : number(0.0, 0.99);
  const auto drive = make_drive(machine, rate, fraction).value();
  const double holding = drive->settle(number(-30.0, 30.0), 0.0);
  // A kick winds the couplings up.
  for (int k = 0; k < 5; ++k) drive->advance(holding + number(-5.0, 5.0));
  const MassSystem system = mass_system(machine.drive);
  double before = energy(system, *drive);
  double unsure_before = rounding(system, *drive);
  for (int k = 0; k < 1500; ++k) {
    drive->advance(0.0);
    const double after = energy(system, *drive);
    const double unsure = rounding(system, *drive);  // each of both sums by its own twists
    RC_ASSERT(after <= before * (1.0 + 1e-13) + unsure + unsure_before);
    before = after;
    unsure_before = unsure;
  }
}

// Oscillating about its mean velocity the driven side comes to a standstill and turns for less than one step
// of the solution, forwards before it and after it: friction that held on to its sign would drive it then.
TEST(Friction, EnergyDoesNotRiseWhereASideTurnsForAMoment) {
  DriveConfig config = test::system_2();
  config.damping = 0.0;
  const MassSystem system = mass_system(config);
  const double rate = 16.5 * resonances(system)[0].frequency_hz;
  const auto drive = make_drive(with_friction(config, {1e-3, 0.0, 0.0}), rate, 0.0).value();
  int slow = 0;
  for (int i = 0; i < 2000; ++i) {
    drive->settle(5.0, 0.0);
    drive->advance(-20.0 - 0.02 * i);
    double before = energy(system, *drive);
    for (int k = 0; k < 40; ++k) {
      drive->advance(0.0);
      const double after = energy(system, *drive);
      ASSERT_LE(after, before * (1.0 + 1e-13) + rounding(system, *drive)) << i << " " << k;
      if (std::abs(drive->motions()[0].velocity) < 0.05) ++slow;
      before = after;
    }
  }
  EXPECT_GT(slow, 100);
}

TEST(Friction, MotionEndsInFiniteTime) {
  for (const double rate : {100.0, 500.0, 4000.0})
    for (std::size_t masses = 1; masses <= 2; ++masses) {
      const auto drive = make_drive(with_friction(test::chain(masses), {0.3, 0.5, 0.5},
                                                  masses > 1 ? DryFriction{0.2, 0.3, 0.5} : DryFriction{}),
                                    rate, 0.0)
                             .value();
      drive->settle(20.0, 0.0);
      for (int k = 0; k < static_cast<int>(6.0 * rate); ++k) drive->advance(0.0);
      const auto rest = drive->motions();
      for (const auto& m : rest) EXPECT_EQ(m.velocity, 0.0);
      for (int k = 0; k < 1000; ++k) drive->advance(0.0);
      for (std::size_t i = 0; i < rest.size(); ++i) EXPECT_EQ(drive->motions()[i].angle, rest[i].angle);
    }
}

// Sticking must not make it slow: a machine that is shaken to and fro over breakaway at a coarse sample time.
TEST(Friction, ShakenMachineGoesOn) {
  const auto drive =
      make_drive(with_friction(test::system_2(), {0.4, 0.5, 0.1}, {0.4, 0.5, 0.1}), 100.0, 0.3).value();
  drive->settle(0.0, 0.0);
  int reversals = 0;
  double last = 0.0;
  for (int k = 0; k < 3000; ++k) {
    const double v = drive->advance(3.0 * std::sin(0.7 * k)).velocity;
    ASSERT_TRUE(std::isfinite(v));
    if (v * last < 0.0) ++reversals;
    last = v;
  }
  EXPECT_GT(reversals, 300);
}

}  // namespace
}  // namespace resonid::plant
