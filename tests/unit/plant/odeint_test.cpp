// SPDX-License-Identifier: MIT
//
// The machines against an adaptive integrator that knows nothing of them: Boost.Odeint, Dormand-Prince 5(4)
// at 1e-13. The equations are written down here. What is constant over a sample agrees to 1e-9, which is the
// integrator's error over the run. What varies within a sample the library holds at its value in the middle
// (stiffness, eccentricity): the difference is of second order in the sample time. So it does
// with friction that depends on the velocity. Instants of stops and starts are exact.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/numeric/odeint/integrate/integrate_adaptive.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/generation.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <cmath>
#include <functional>

#include "machines.hpp"

namespace resonid::plant {
namespace {

using State = std::array<double, 5>;  // velocities of motor and load, their angles, the motor's torque

/// Two masses at the driven shaft; what is not given is not there.
struct TwoMasses {
  double driven = 0.032, load = 0.032;
  std::function<double(double, double)> stiffness = [](double, double) {
    return 143.75;
  };                                                                   // time, load angle
  std::function<double(double)> damping = [](double) { return 0.3; };  // of the stiffness
  std::function<double(double)> load_torque = [](double) { return 0.0; };
  double eccentricity = 0.0;
  double lag_s = 0.0;
  double motor_ground = 0.0, load_ground = 0.0;
  double play = 0.0, stiffening = 0.0;  // rad; 0: none
  int side = 0;                         // of the play that is touched

  void slopes(const State& x, State& dx, double t, double command) const {
    const double k = stiffness(t, x[3]);
    double shaft = k * (x[2] - x[3] + eccentricity * std::sin(x[2])) + damping(k) * (x[0] - x[1]);
    if (play > 0.0 || stiffening > 0.0) {
      const double d = x[2] - x[3] - 0.5 * side * play;
      const double twice = stiffening > 0.0 ? d / stiffening : 0.0;
      const bool touches = play == 0.0 || side != 0;
      shaft = touches ? k * d * (1.0 + twice * twice) + damping(k) * (x[0] - x[1]) : 0.0;
    }
    dx[0] = ((lag_s > 0.0 ? x[4] : command) - shaft - motor_ground * x[2]) / driven;
    dx[1] = (shaft + load_torque(t) - load_ground * x[3]) / load;
    dx[2] = x[0];
    dx[3] = x[1];
    dx[4] = lag_s > 0.0 ? (command - x[4]) / lag_s : 0.0;
  }
  void advance(State& x, double from_s, double to_s, double command) const {
    namespace ode = boost::numeric::odeint;
    ode::integrate_adaptive(
        ode::make_controlled<ode::runge_kutta_dopri5<State>>(1e-13, 1e-13),
        [&](const State& s, State& ds, double t) { slopes(s, ds, t, command); }, x, from_s, to_s,
        0.1 * (to_s - from_s));
  }
};

/// The same in time at any multiple of 250 Hz: held over 4 ms.
double torque_at(int k, double rate) {
  const auto held = static_cast<int>(k * 250.0 / rate + 1e-9);
  return 0.8 * std::sin(0.31 * held) + 0.5 * std::sin(0.0137 * held * held);
}

/// Largest deviation of the driven velocity over its largest deviation from `around`.
double deviation(Drive& drive, const TwoMasses& model, double rate, int samples, double velocity,
                 double place = 0.0) {
  const double around = drive.settle(velocity, place);
  const auto motions = drive.motions();
  State x{motions[0].velocity, motions[1].velocity, motions[0].angle, motions[1].angle, around};
  double worst = 0.0;
  double largest = 0.0;
  for (int k = 0; k < samples; ++k) {
    const double torque = around + torque_at(k, rate);
    drive.advance(torque);
    model.advance(x, k / rate, (k + 1) / rate, torque);
    worst = std::max(worst, std::abs(drive.motions()[0].velocity - x[0]));
    largest = std::max(largest, std::abs(x[0] - velocity));
  }
  return worst / largest;
}

double two_mass_deviation(const MachineConfig& machine, const TwoMasses& model, double rate, double seconds,
                          double velocity = 0.0) {
  const auto drive = make_drive(machine, rate, 0.0, seconds).value();
  return deviation(*drive, model, rate, static_cast<int>(seconds * rate), velocity);
}

MachineConfig system_2() { return {test::system_2(), {}, {}, 0.0}; }

TEST(AgainstOdeint, LinearMachineWithLagAndLoadSteps) {
  MachineConfig machine = system_2();
  machine.torque_lag_s = 0.003;
  machine.disturbance.load_torque = 0.2;
  machine.disturbance.load_step = {0.5, -1.0};
  machine.disturbance.load_step_at_s = {0.3, 0.7};
  TwoMasses model;
  model.lag_s = 0.003;
  // A sample's end: where k/rate rounds to just before the step, it still belongs to the sample before.
  model.load_torque = [](double t) { return 0.2 + (t > 0.3 ? 0.5 : 0.0) - (t > 0.7 ? 1.0 : 0.0); };
  EXPECT_LT(two_mass_deviation(machine, model, 500.0, 1.0), 1e-9);
}

TEST(AgainstOdeint, MachineOnSpringsStartsBesideTheirRest) {
  MachineConfig machine = system_2();
  machine.drive.motor_ground_stiffness = 12.0;
  machine.drive.load_ground_stiffness = 31.0;
  machine.torque_lag_s = 0.003;
  machine.disturbance.load_torque = 0.2;
  TwoMasses model;
  model.lag_s = 0.003;
  model.motor_ground = 12.0;
  model.load_ground = 31.0;
  model.load_torque = [](double) { return 0.2; };
  const auto drive = make_drive(machine, 500.0, 0.0).value();
  // At rest at 0.7 rad: (31 + K) (angle of the load) = K 0.7 + 0.2.
  const double load_angle = (143.75 * 0.7 + 0.2) / (31.0 + 143.75);
  EXPECT_NEAR(drive->settle(0.0, 0.7), 12.0 * 0.7 + 143.75 * (0.7 - load_angle), 1e-12);
  EXPECT_NEAR(drive->motions()[1].angle, load_angle, 1e-14);
  EXPECT_LT(deviation(*drive, model, 500.0, 500, 0.0, 0.7), 1e-9);
}

TEST(AgainstOdeint, DriftingStiffness) {
  MachineConfig machine = system_2();
  machine.disturbance.stiffness_drift_per_s = -0.2;
  TwoMasses model;
  model.stiffness = [](double t, double) { return 143.75 * (1.0 - 0.2 * t); };
  const double coarse = two_mass_deviation(machine, model, 500.0, 3.0);
  EXPECT_LT(coarse, 1e-5);
  EXPECT_LT(two_mass_deviation(machine, model, 1000.0, 3.0), 0.3 * coarse);  // of second order
}

TEST(AgainstOdeint, BeltThatComesLoose) {
  MachineConfig machine = system_2();
  machine.disturbance.loosening = 0.3;
  machine.disturbance.loosening_at_s = 0.5;
  machine.disturbance.loosening_over_s = 0.4;
  TwoMasses model;
  model.stiffness = [](double t, double) {
    return 143.75 * (1.0 - 0.3 * std::clamp((t - 0.5) / 0.4, 0.0, 1.0));
  };
  EXPECT_LT(two_mass_deviation(machine, model, 500.0, 1.5), 3e-5);
  machine.disturbance.loosening_over_s = 0.0;
  model.stiffness = [](double t, double) { return 143.75 * (t > 0.5 ? 0.7 : 1.0); };
  EXPECT_LT(two_mass_deviation(machine, model, 500.0, 1.5), 1e-9);
}

// Its greatest stiffness lies within the fault, at neither end of it.
TEST(AgainstOdeint, BeltThatStiffensWhileItComesLoose) {
  MachineConfig machine = system_2();
  machine.disturbance.stiffness_drift_per_s = 0.5;
  machine.disturbance.loosening = 0.5;
  machine.disturbance.loosening_over_s = 2.0;
  TwoMasses model;
  model.stiffness = [](double t, double) { return 143.75 * (1.0 + 0.5 * t) * (1.0 - 0.25 * t); };
  EXPECT_LT(two_mass_deviation(machine, model, 500.0, 2.0), 3e-5);
}

TEST(AgainstOdeint, Eccentricity) {
  MachineConfig machine = system_2();
  machine.disturbance.eccentricity = 1e-4;  // m, at the radius of 0.05 m
  TwoMasses model;
  model.eccentricity = 2e-3;
  const double coarse = two_mass_deviation(machine, model, 500.0, 2.0, 20.0);
  const double fine = two_mass_deviation(machine, model, 1000.0, 2.0, 20.0);
  EXPECT_LT(coarse, 3e-4);
  EXPECT_LT(fine, 0.3 * coarse);  // of second order
}

TEST(AgainstOdeint, ToothBeltOverItsStroke) {
  const DriveConfig belt = test::tooth_belt();
  TwoMasses model;
  const double r2 = 0.0199 * 0.0199;
  model.driven = 0.0028;
  model.load = 6.7 * r2;
  model.stiffness = [&](double, double load_angle) {
    const double x = 0.0199 * load_angle;
    const double k1 = 376406.25 / x;
    const double k2 = 376406.25 / (1.7 - x);
    const double k3 = 376406.25 / 2.14;
    return r2 * (k1 + k2 * k3 / (k2 + k3));
  };
  model.damping = [&](double k) { return k / (std::sqrt(k * (1.0 / 0.0028 + 1.0 / (6.7 * r2))) * 10.0); };
  struct Run {
    double rate, velocity, seconds, accuracy;
  };
  // At 4 ms the resonance, 90 Hz at first, has less than three samples in a period.
  for (const Run& run : {Run{2000.0, 0.38, 3.3, 1e-5}, Run{250.0, 0.06, 21.0, 1e-4}}) {
    const double rate = run.rate;
    const double velocity = run.velocity;
    const auto drive = make_drive({belt, {}, {}, 0.0}, rate, 0.0).value();
    const double around = drive->settle(velocity / 0.0199, 0.38);
    const auto motions = drive->motions();
    State x{motions[0].velocity, motions[1].velocity, motions[0].angle, motions[1].angle, around};
    double worst = 0.0;
    double largest = 0.0;
    for (int k = 0; k < static_cast<int>(run.seconds * rate); ++k) {
      // Weak feedback keeps the cart on its way, the same of both.
      const double y = drive->motions()[0].velocity;
      const double torque = around + torque_at(k, rate) - 0.05 * (y - velocity / 0.0199);
      drive->advance(torque);
      model.advance(x, k / rate, (k + 1) / rate, torque);
      worst = std::max(worst, std::abs(drive->motions()[0].velocity - x[0]));
      largest = std::max(largest, std::abs(x[0] - velocity / 0.0199));
    }
    EXPECT_GT(drive->place(), 1.4);
    EXPECT_NEAR(drive->place(), 0.0199 * x[3], 1e-6);
    EXPECT_LT(worst / largest, run.accuracy) << rate;
  }
}

/// The two masses with sides that slide or stick. Dry friction makes the slopes jump where a side stops or
/// starts: the integrator is stopped there, at the instant that bisection finds.
struct StickSlip {
  TwoMasses model;
  std::array<DryFriction, 2> friction;  // of motor and load
  std::array<int, 2> direction{};
  State x{};
  int stops = 0, starts = 0, touches = 0;

  [[nodiscard]] bool dry(std::size_t i) const { return friction[i].any(); }
  [[nodiscard]] double coulomb(std::size_t i, double way) const {
    const DryFriction& f = friction[i];
    return way < 0.0 && f.coulomb_negative > 0.0 ? f.coulomb_negative : f.coulomb;
  }
  [[nodiscard]] double sliding(std::size_t i, double velocity) const {
    const double slow = coulomb(i, direction[i]);
    const double fall = std::max(friction[i].breakaway - slow, 0.0);
    const double vs = friction[i].stribeck_velocity;
    return slow + (vs > 0.0 ? fall * std::exp(-velocity * velocity / (vs * vs)) : 0.0);
  }
  /// Torque without friction.
  [[nodiscard]] double pull(std::size_t i, const State& s, double t, double command) const {
    State slope{};
    model.slopes(s, slope, t, command);
    return slope[i] * (i == 0 ? model.driven : model.load);
  }
  [[nodiscard]] State after(double from, double to, double command) const {
    namespace ode = boost::numeric::odeint;
    State s = x;
    if (!(to > from)) return s;
    const auto slopes = [&](const State& a, State& da, double t) {
      model.slopes(a, da, t, command);
      for (std::size_t i = 0; i < 2; ++i) {
        if (!dry(i)) continue;
        da[i] -= direction[i] * sliding(i, a[i]) / (i == 0 ? model.driven : model.load);
        if (direction[i] == 0) da[i] = 0.0;
      }
    };
    ode::integrate_adaptive(ode::make_controlled<ode::runge_kutta_dopri5<State>>(1e-13, 1e-13), slopes, s,
                            from, to, 0.1 * (to - from));
    return s;
  }
  [[nodiscard]] bool side_changes(const State& s) const {
    if (model.play == 0.0) return false;
    const double twist = s[2] - s[3];
    return model.side == 0 ? std::abs(twist) > 0.5 * model.play : twist * model.side < 0.5 * model.play;
  }
  [[nodiscard]] bool changes(std::size_t i, const State& s, double t, double command) const {
    if (!dry(i)) return false;
    if (direction[i] != 0) return s[i] * direction[i] < 0.0;
    const double pulled = pull(i, s, t, command);
    return std::abs(pulled) > std::max(coulomb(i, pulled), friction[i].breakaway);
  }
  [[nodiscard]] bool any_changes(const State& s, double t, double command) const {
    return changes(0, s, t, command) || changes(1, s, t, command) || side_changes(s);
  }
  void change(double t, double command) {
    if (side_changes(x)) {
      ++touches;
      model.side = model.side != 0 ? 0 : x[2] > x[3] ? 1 : -1;
    }
    for (std::size_t i = 0; i < 2; ++i) {
      if (!changes(i, x, t, command)) continue;
      ++(direction[i] == 0 ? starts : stops);
      if (direction[i] == 0) {
        direction[i] = pull(i, x, t, command) > 0.0 ? 1 : -1;
      } else {
        direction[i] = 0;
        x[i] = 0.0;
      }
    }
  }
  void advance(double now, double end, double command) {
    for (;;) {
      for (int i = 0; i < 2; ++i) change(now, command);  // one that stops may start the other way at once
      const State whole = after(now, end, command);
      if (!any_changes(whole, end, command)) {
        x = whole;
        return;
      }
      double low = 0.0;
      double high = end - now;
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (low + high);
        (any_changes(after(now, now + middle, command), now + middle, command) ? high : low) = middle;
      }
      x = after(now, now + high, command);
      now += high;
    }
  }
};

/// Largest deviation of both velocities over the largest velocity, from rest under 2 s of a sine, held over
/// 2 ms at any rate.
double stick_slip_deviation(StickSlip reference, double amplitude, double rate) {
  MachineConfig machine = system_2();
  machine.friction = {reference.friction[0], reference.friction[1]};
  machine.drive.motor_ground_stiffness = reference.model.motor_ground;
  machine.drive.load_ground_stiffness = reference.model.load_ground;
  machine.drive.backlash = 0.05 * reference.model.play;  // of the belt
  machine.drive.stiffening_twist = 0.05 * reference.model.stiffening;
  machine.torque_lag_s = reference.model.lag_s;
  const auto drive = make_drive(machine, rate, 0.0).value();
  drive->settle(0.0, 0.0);
  double worst = 0.0;
  double largest = 0.0;
  for (int k = 0; k < static_cast<int>(2.0 * rate); ++k) {
    const auto held = static_cast<int>(k * 500.0 / rate + 1e-9);
    const double torque = amplitude * std::sin(2.0 * 3.141592653589793 * 2.7 * held / 500.0);
    drive->advance(torque);
    const int parts = std::max(1, static_cast<int>(500.0 / rate));  // it looks for events at their ends only
    for (int i = 0; i < parts; ++i)
      reference.advance((k + static_cast<double>(i) / parts) / rate, (k + (i + 1.0) / parts) / rate, torque);
    const auto motions = drive->motions();
    for (std::size_t i = 0; i < 2; ++i) {
      worst = std::max(worst, std::abs(motions[i].velocity - reference.x[i]));
      largest = std::max(largest, std::abs(reference.x[i]));
    }
  }
  if (reference.dry(0) || reference.dry(1)) {
    EXPECT_GE(reference.stops, 10);
    EXPECT_GE(reference.starts, 10);
  }
  if (reference.model.play > 0.0) {
    EXPECT_GE(reference.touches, 20);
  }
  return worst / largest;
}

// Friction that does not depend on the velocity is constant between the events: what is left is the
// integrator's error, and that of the instants, 1e-13 of velocity over acceleration each.
TEST(AgainstOdeint, StickAndSlipOfTheDrivenSide) {
  EXPECT_LT(stick_slip_deviation({{}, {DryFriction{0.3, 0.45, 0.0}, {}}}, 0.9, 500.0), 1e-9);
}
TEST(AgainstOdeint, StickAndSlipOfTheLoad) {
  EXPECT_LT(stick_slip_deviation({{}, {DryFriction{}, {0.3, 0.45, 0.0}}}, 0.9, 500.0), 1e-9);
}
TEST(AgainstOdeint, StickAndSlipOfBothSides) {
  EXPECT_LT(stick_slip_deviation({{}, {DryFriction{0.3, 0.45, 0.0}, {0.2, 0.25, 0.0}}}, 1.5, 500.0), 1e-9);
}

TEST(AgainstOdeint, StickAndSlipThatDependsOnTheDirection) {
  EXPECT_LT(stick_slip_deviation({{}, {DryFriction{0.3, 0.45, 0.0, 0.5}, {0.2, 0.25, 0.0, 0.1}}}, 1.7, 500.0),
            1e-9);
}
TEST(AgainstOdeint, StickAndSlipOfAMachineOnSprings) {
  StickSlip reference{{}, {DryFriction{0.3, 0.45, 0.0}, {0.2, 0.25, 0.0}}};
  reference.model.motor_ground = 3.0;
  reference.model.load_ground = 20.0;
  EXPECT_LT(stick_slip_deviation(reference, 1.5, 500.0), 1e-9);
}

// The twist exceeds the one at which the torque doubles.
TEST(AgainstOdeint, CouplingThatStiffens) {
  for (const double rate : {100.0, 500.0}) {
    StickSlip reference{};
    reference.model.stiffening = 4e-3;
    EXPECT_LT(stick_slip_deviation(reference, 1.5, rate), 1e-9) << rate;
    reference.model.lag_s = 0.002;
    EXPECT_LT(stick_slip_deviation(reference, 1.5, rate), 1e-9) << rate;
  }
}
TEST(AgainstOdeint, CouplingWithPlay) {
  for (const double rate : {100.0, 500.0}) {
    StickSlip reference{};
    reference.model.play = 0.02;
    EXPECT_LT(stick_slip_deviation(reference, 1.5, rate), 1e-8) << rate;
    reference.model.stiffening = 4e-3;
    reference.model.lag_s = 0.002;
    EXPECT_LT(stick_slip_deviation(reference, 1.5, rate), 1e-8) << rate;
  }
}
TEST(AgainstOdeint, CouplingWithPlayUnderDryFriction) {
  StickSlip reference{{}, {DryFriction{0.3, 0.45, 0.0, 0.5}, {0.2, 0.25, 0.0}}};
  reference.model.play = 0.02;
  reference.model.stiffening = 6e-3;
  EXPECT_LT(stick_slip_deviation(reference, 1.7, 500.0), 1e-8);
}

// Under a load torque the coupling rests on one side of its play, twisted as far as the torque takes it.
TEST(AgainstOdeint, CouplingWithPlayStartsInItsBalance) {
  MachineConfig machine = system_2();
  machine.drive.backlash = 0.05 * 0.02;
  machine.drive.stiffening_twist = 0.05 * 4e-3;
  machine.disturbance.load_torque = 143.75 * 2e-3 * 1.25;  // of a twist of half of that
  const auto drive = make_drive(machine, 500.0, 0.0).value();
  EXPECT_NEAR(drive->settle(0.0, 0.3), -machine.disturbance.load_torque, 1e-12);
  EXPECT_NEAR(drive->motions()[1].angle, 0.3 + 0.01 + 2e-3, 1e-14);
  for (int k = 0; k < 500; ++k) drive->advance(-machine.disturbance.load_torque);
  EXPECT_NEAR(drive->motions()[1].angle, 0.3 + 0.01 + 2e-3, 1e-11);
  machine.disturbance.load_torque = 0.0;
  machine.disturbance.eccentricity = 1e-4;
  EXPECT_EQ(std::string(make_drive(machine, 500.0, 0.0).error().field), "eccentricity");
  machine.drive.load_ground_stiffness = 1.0;
  EXPECT_EQ(std::string(make_drive(machine, 500.0, 0.0).error().field), "load_ground_stiffness");
}

// Stribeck friction is held over steps of h at its value at a velocity in their middle. With |dv/dt| <= a the
// torque is wrong by up to (a h)^2 max|f''|/24 in the mean, and by f' times a velocity wrong by as much as
// the friction's own change in the prediction, of the same order: twice (a h)^2 2 (Tb - Tc)/vs^2/24 in all.
// The velocities take it up over the slow part of half a period, on the inertia of one side.
TEST(AgainstOdeint, StribeckFrictionIsOfSecondOrder) {
  const DryFriction driven{0.3, 0.45, 0.8};
  const DryFriction load{0.1, 0.2, 0.8};
  const StickSlip reference{{}, {driven, load}};
  const double coarse = stick_slip_deviation(reference, 2.0, 500.0);
  const double fine = stick_slip_deviation(reference, 2.0, 2000.0);
  const double a = 2.0 / 0.032;
  const double torque = 2.0 * std::pow(a / 500.0, 2) * 2.0 * 0.15 / (0.8 * 0.8) / 24.0;
  EXPECT_LT(coarse, torque / 0.032 * 0.5 / 2.7);
  EXPECT_LT(fine, coarse / 8.0);
}

// A rigid machine under constant torque just above breakaway: J dv/dt = T - f(v), from rest. The falling
// friction makes dv/dt grow at the rate b <= 0.858 (Tb - Tc)/(vs J), and h b is at most 1/10 in a step, of a
// midpoint rule: wrong by (h b)^2/6 of itself while it grows by e. It grows from 0.1 Nm/J to 0.8 Nm/J.
TEST(AgainstOdeint, RigidMachineBreaksAwayAlongItsStribeckCurve) {
  namespace ode = boost::numeric::odeint;
  DriveConfig rigid = test::rigid();
  rigid.driven_inertia = 0.02;
  rigid.viscous_friction = 0.0;
  const DryFriction friction{0.2, 0.9, 0.5};
  for (const double rate : {100.0, 250.0, 1000.0}) {
    const auto drive = make_drive({rigid, {friction, {}}, {}, 0.0}, rate, 0.0).value();
    drive->settle(0.0, 0.0);
    double v = 0.0;
    for (int k = 0; k < static_cast<int>(0.5 * rate); ++k) {
      ode::integrate_adaptive(
          ode::make_controlled<ode::runge_kutta_dopri5<double>>(1e-13, 1e-13),
          [&](const double& w, double& slope, double) { slope = (1.0 - friction.sliding(w)) / 0.02; }, v, 0.0,
          1.0 / rate, 0.01 / rate);
      const double got = drive->advance(1.0).velocity;
      ASSERT_NEAR(got, v, std::log(8.0) * 0.01 / 6.0 * v) << rate << " " << k;
    }
  }
}

}  // namespace
}  // namespace resonid::plant
