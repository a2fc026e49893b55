// SPDX-License-Identifier: MIT
// The exact gains of a PID against every gain on a grid, by its transfer function at many frequencies.
#include "design/pid.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

Machine system_2() { return test::golden_machine({0.032, 0.032, 143.75, 0.3}, 0.002, 0.004); }

/// Those of the default, and twice the |C S| of the best PI.
Bounds calm_bounds(double& pi_iae) {
  Bounds bounds;
  bounds.sensitivity = 1.4;
  bounds.load_transfer = 1.3;
  Machines machines({system_2()});
  const auto pi = largest_integral_gain(machines, {}, bounds);
  EXPECT_TRUE(pi);
  const auto f = figures_of(system_2(), FilteredPi{pi->kp, pi->ki, {}});
  pi_iae = f.load_step.iae;
  bounds.controller_sensitivity = 2.0 * f.peak(Transfer::controller_sensitivity).value;
  return bounds;
}

/// Largest of all bounded transfers over their bounds, on lines alone.
double excess(const Machine& machine, const Pid& pid, const Bounds& bounds) {
  const auto controller = pid.transfer_function(machine.sample_time_s());
  double most = 0.0;
  for (double hz = 0.05; hz < 249.0; hz *= 1.003) {
    const auto plant = machine.response().at(std::array{hz}).front();
    const auto c = controller.response(hz), s = 1.0 / (1.0 + c * plant.measured);
    most = std::max({most, std::abs(s) / *bounds.sensitivity,
                     std::abs(c * plant.load * s) / *bounds.load_transfer,
                     std::abs(c * s) / *bounds.controller_sensitivity});
  }
  return most;
}

TEST(Pid, HasTheLargestIntegralGainUnderItsBounds) {
  double pi_iae = 0.0;
  const Bounds bounds = calm_bounds(pi_iae);
  const auto machine = system_2();
  for (const PidShape shape : {PidShape{0.0011, 0.0006}, PidShape{0.004, 0.008}, PidShape{0.02, 0.002}}) {
    SCOPED_TRACE(shape.time_s);
    Machines machines({machine});
    const auto gains = largest_pid_gain(machines, shape, bounds);
    ASSERT_TRUE(gains);
    const auto pid_of = [&](double kp, double ki) { return Pid{kp, ki, kp * shape.time_s, shape.filter_s}; };
    const auto best = pid_of(gains->kp, gains->ki);
    EXPECT_NEAR(excess(machine, best, bounds), 1.0, 1e-3);
    const auto f = figures_of(machine, LinearController(best.transfer_function(0.002)));
    EXPECT_TRUE(f.stable);
    for (const auto transfer : bounded_transfers(bounds))
      EXPECT_LE(f.peak(transfer).value, *bound_of(bounds, transfer) * (1.0 + 1e-8));
    // No kp allows more.
    for (int i = 1; i <= 60; ++i)
      EXPECT_GT(excess(machine, pid_of(2.0 * gains->kp * i / 60.0, 1.003 * gains->ki), bounds), 1.0) << i;
  }
}

/// A search over all four numbers, without exact gains, came to 0.0453.
TEST(Pid, IsSearchedForTheLeastErrorOfTheLoad) {
  double pi_iae = 0.0;
  const Bounds bounds = calm_bounds(pi_iae);
  Machines machines({system_2()});
  const auto found = search_pid(machines, bounds);
  ASSERT_TRUE(found);
  EXPECT_LT(found->iae, 0.0454);
  EXPECT_LT(found->iae, 0.86 * pi_iae);
  const auto& c = found->controller;
  const auto f = figures_of(system_2(), LinearController(c.transfer_function(0.002)));
  EXPECT_NEAR(f.load_step.iae, found->iae, 1e-9);
  Machines stiffer({test::golden_machine({0.032, 0.032, 150.0, 0.3}, 0.002, 0.004)});
  Machines alike = stiffer;
  const auto again = search_pid(alike, bounds, {}, c), anew = search_pid(stiffer, bounds);
  ASSERT_TRUE(again && anew);
  EXPECT_NEAR(again->iae, anew->iae, 5e-3 * anew->iae);
}

}  // namespace
}  // namespace resonid::design
