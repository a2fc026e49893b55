// SPDX-License-Identifier: MIT
// Loops that meet every bound on their margins and are unstable (docs/methods/tune.md 4.3): margins never say
// that a loop is stable.
#include <gtest/gtest.h>

#include <cmath>

#include "design/figures.hpp"
#include "design/response_disks.hpp"
#include "design/robust.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

struct Trap {
  const char* plant;
  double sensitivity;
  FilteredPi controller;
};
/// Far beyond all crossings with any ki, and at the end of intervals that begin at ki = 0.
const std::vector<Trap>& traps() {
  static const std::vector<Trap> all = {{"system2", 1.4, {50.0, 9000.0, {}}},
                                        {"system2", 1.4, {2.0, 2253.0, {}}},
                                        {"system2", 2.0, {15.6, 97.0, {}}},
                                        {"R2", 2.0, {10.4, 143.0, {}}},
                                        {"R5", 2.0, {4.8, 129.0, {}}}};
  return all;
}

Machine machine_of(const nlohmann::json& golden, const std::string& plant) {
  for (const auto& c : golden.at("cases"))
    if (c.at("plant") == plant) return test::golden_machines(c).front();
  throw std::out_of_range(plant);
}

Bounds only_sensitivity(double bound) {
  Bounds bounds;
  bounds.sensitivity = bound;
  return bounds;
}

TEST(UnstableLoops, MeetTheirMarginsAndAreKnownAsUnstable) {
  const auto golden = test::golden_json("e_tune_pi.json");
  for (const Trap& trap : traps()) {
    SCOPED_TRACE(testing::Message() << trap.plant << " " << trap.controller.kp << " " << trap.controller.ki);
    const Machine machine = machine_of(golden, trap.plant);
    std::vector<double> dense;
    for (int i = 0; i < 20'000; ++i)
      dense.push_back(0.5 / machine.sample_time_s() * std::pow(10.0, -5.0 * i / 20'000));
    for (const auto& v :
         LoopFunctions(machine.response(), trap.controller, machine.sample_time_s()).at(dense))
      ASSERT_LE(v.size_of(Transfer::sensitivity), trap.sensitivity);
    const auto figures = figures_of(machine, trap.controller);
    EXPECT_FALSE(figures.stable);
    EXPECT_GT(figures.spectral_radius, 1.1);
    EXPECT_FALSE(std::isfinite(load_step_iae(machine, trap.controller)));
  }
}

/// Though they have far more ki than what is.
TEST(UnstableLoops, AreNeverProposed) {
  const auto golden = test::golden_json("e_tune_pi.json");
  for (const Trap& trap : traps()) {
    SCOPED_TRACE(testing::Message() << trap.plant << " " << trap.controller.kp);
    const Machine machine = machine_of(golden, trap.plant);
    const Bounds bounds = only_sensitivity(trap.sensitivity);
    const auto expect_stable = [&](const FilteredPi& found) {
      EXPECT_TRUE(figures_of(machine, found).stable);
      EXPECT_LE(figures_of(machine, found).peak(Transfer::sensitivity).value, trap.sensitivity * 1.0001);
    };
    Machines alone({machine});
    const auto gains = largest_integral_gain(alone, {}, bounds);
    ASSERT_TRUE(gains);
    expect_stable({gains->kp, gains->ki, {}});

    const Posterior posterior(machine.model(), {fit::kStiffness, fit::kDelay},
                              Eigen::Vector2d(1e-4, 1e-8).asDiagonal());
    const auto confident = confident_design(posterior, {.biquads = 0}, bounds, {.draws = 1000});
    ASSERT_TRUE(confident);
    EXPECT_EQ(confident->check.unstable, 0U);
    expect_stable(confident->design.controller);

    ResponseDisks disks;
    disks.sample_time_s = machine.sample_time_s();
    for (double f = 0.25; f <= 249.0; f *= 1.02) disks.frequencies_hz.push_back(f);
    for (const auto& value : machine.response().at(disks.frequencies_hz)) {
      disks.centres.push_back(value.measured);
      disks.radii.push_back(0.01 * std::abs(value.measured));
    }
    const auto measured = largest_integral_gain(disks, {}, bounds);
    ASSERT_TRUE(measured);
    expect_stable(measured->controller);
  }
}

/// The interval of ki that holds the trap meets the bound from its beginning to its end.
TEST(UnstableLoops, MayBeginAtNoIntegralGain) {
  const auto golden = test::golden_json("e_tune_pi.json");
  const Machine machine = machine_of(golden, "R2");
  const MachineLines lines(machine);
  QuadraticRows rows;
  for (const auto& line : lines.lines()) rows.add(line, 1.0, only_sensitivity(2.0));
  EXPECT_GT(rows.largest_integral(10.4), 143.0);
  EXPECT_LT(rows.largest_proportional(), 10.4);  // what keeps the search away from it
}

}  // namespace
}  // namespace resonid::design
