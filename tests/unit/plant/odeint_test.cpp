// SPDX-License-Identifier: MIT
//
// The machines against an adaptive integrator that knows nothing of them: Boost.Odeint, Dormand-Prince 5(4)
// at 1e-13. The equations are written down here. What is constant over a sample agrees to 1e-9, which is the
// integrator's error over the run. What varies within a sample the library holds at its value in the middle
// (stiffness, eccentricity): the difference is of second order in the sample time. Friction that depends on
// the velocity it holds at the value at the start of a step of its own, of first order.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
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
  DryFriction friction, load_friction;

  static double dry(const DryFriction& f, double v) {
    return v == 0.0 ? 0.0 : std::copysign(f.sliding(v), v);
  }
  void slopes(const State& x, State& dx, double t, double command) const {
    const double k = stiffness(t, x[3]);
    const double shaft = k * (x[2] - x[3] + eccentricity * std::sin(x[2])) + damping(k) * (x[0] - x[1]);
    dx[0] = ((lag_s > 0.0 ? x[4] : command) - shaft - dry(friction, x[0])) / driven;
    dx[1] = (shaft + load_torque(t) - dry(load_friction, x[1])) / load;
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
double deviation(Drive& drive, const TwoMasses& model, double rate, int samples, double velocity) {
  const double around = drive.settle(velocity, 0.0);
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

// Dry friction makes the slopes jump where a side turns, so the integrator is stopped there: short of each
// reversal it goes by bisection to the instant, and friction changes its sign. Torques well above breakaway
// keep the sides from resting.
TEST(AgainstOdeint, FrictionThatTurns) {
  MachineConfig machine = system_2();
  machine.friction.driven = {0.3, 0.45, 0.8};
  for (const double rate : {500.0, 2000.0}) {
    const auto drive = make_drive(machine, rate, 0.0).value();
    drive->settle(0.0, 0.0);
    TwoMasses model;
    State x{};
    int direction = 1;
    double worst = 0.0;
    double largest = 0.0;
    int turns = 0;
    const auto with_direction = [&](State& s, double from, double to, double command) {
      namespace ode = boost::numeric::odeint;
      ode::integrate_adaptive(
          ode::make_controlled<ode::runge_kutta_dopri5<State>>(1e-13, 1e-13),
          [&](const State& a, State& da, double t) {
            model.slopes(a, da, t, command - direction * machine.friction.driven.sliding(a[0]));
          },
          s, from, to, 0.1 * (to - from));
    };
    for (int k = 0; k < static_cast<int>(2.0 * rate); ++k) {
      const double torque = 3.0 * std::cos(2.0 * 3.141592653589793 * 3.0 * k / rate);
      drive->advance(torque);
      double now = k / rate;
      const double end = (k + 1) / rate;
      while (now < end) {
        State next = x;
        with_direction(next, now, end, torque);
        if (next[0] * direction >= 0.0) {
          x = next;
          break;
        }
        double low = 0.0;
        double high = end - now;
        for (int i = 0; i < 60; ++i) {
          const double middle = 0.5 * (low + high);
          next = x;
          if (middle > 0.0) with_direction(next, now, now + middle, torque);
          (next[0] * direction >= 0.0 ? low : high) = middle;
        }
        if (high > 0.0) with_direction(x, now, now + high, torque);
        now += high;
        x[0] = 0.0;
        State slope{};
        model.slopes(x, slope, now, torque);
        const double net = slope[0] * model.driven;  // without friction
        ASSERT_GT(std::abs(net), 0.45) << "it would rest";
        direction = net > 0.0 ? 1 : -1;
        ++turns;
      }
      worst = std::max(worst, std::abs(drive->motions()[0].velocity - x[0]));
      largest = std::max(largest, std::abs(x[0]));
    }
    EXPECT_GE(turns, 11);
    EXPECT_LT(worst / largest, rate == 500.0 ? 2e-3 : 5e-4);
  }
}

}  // namespace
}  // namespace resonid::plant
