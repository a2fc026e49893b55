// SPDX-License-Identifier: MIT
// Searches of every structure on machines of other kinds and sizes than the golden ones.
#include <gtest/gtest.h>

#include "design/cascade.hpp"
#include "design/figures.hpp"
#include "design/largest_gain.hpp"
#include "design/rst.hpp"
#include "design/state_feedback.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

struct Drive {
  const char* name;
  Machine machine;
};
std::vector<Drive> drives() {
  return {{"rigid", test::golden_machine({0.05, 0.02}, 0.002, 0.003)},
          {"bench", test::golden_machine({0.00269, 0.00269, 310.0, 0.028}, 0.0004, 0.0004)},
          {"large", test::golden_machine({32.0, 32.0, 143750.0, 300.0}, 0.002, 0.0047)},
          {"three masses", test::golden_machine({0.02, 0.01, 0.03, 400.0, 300.0, 0.2, 0.2}, 0.001, 0.002)}};
}

Bounds bounds_for(const Machine& machine, double& pi_iae) {
  Bounds bounds;
  bounds.sensitivity = 1.6;
  bounds.load_transfer = 1.4;
  Machines machines({machine});
  const auto pi = largest_integral_gain(machines, {}, bounds);
  EXPECT_TRUE(pi);
  const auto f = figures_of(machine, FilteredPi{pi->kp, pi->ki, {}});
  pi_iae = f.load_step.iae;
  bounds.controller_sensitivity = 2.0 * f.peak(Transfer::controller_sensitivity).value;
  return bounds;
}

void expect_within(const Machine& machine, const LinearController& controller, const Bounds& bounds) {
  const auto f = figures_of(machine, controller);
  EXPECT_TRUE(f.stable);
  for (const Transfer transfer : kTransfers)
    if (const auto bound = bound_of(bounds, transfer)) {
      EXPECT_LT(f.peak(transfer).value, *bound * (1.0 + 5e-3));
    }
}

TEST(Structures, FitMachinesOfEveryKindAndSize) {
  for (const auto& [name, machine] : drives()) {
    SCOPED_TRACE(name);
    double pi = 0.0;
    const Bounds bounds = bounds_for(machine, pi);
    Machines machines({machine}, 0.3);
    const auto rst = search_rst(machines, bounds, {}, {20, 15, 1});
    ASSERT_TRUE(rst);
    expect_within(machine, LinearController(rst->rst.controller(machine.sample_time_s())), bounds);
    const auto state = search_state_feedback(machines, bounds, {20, 15, 1});
    ASSERT_TRUE(state);
    expect_within(machine, {state->feedback.controller, machine.sample_time_s()}, bounds);
    EXPECT_LT(rst->iae, pi);
    EXPECT_LT(state->iae, pi);
    const auto cascade = search_cascade(machines, default_cascade_bounds());
    ASSERT_TRUE(cascade);
    expect_within(machine, linear_controller(cascade->cascade, machine.sample_time_s()),
                  default_cascade_bounds());
  }
}

}  // namespace
}  // namespace resonid::design
