// SPDX-License-Identifier: MIT
// The loop before anything is identified: shares of unstable machines against an independent implementation
// (tests/golden/e_tune_structures.json, "first_tune").
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <golden.hpp>
#include <numbers>
#include <resonid/design/detail/bounds.hpp>

#include "design/closed_loop.hpp"
#include "design/first_loop.hpp"
#include "golden_machines.hpp"

namespace resonid::design {
namespace {

constexpr double kStep = 0.002, kDelay = 0.004, kLag = kDelay + 0.5 * kStep;
constexpr double kTotal = 0.05;

struct Split {
  double ratio, resonance_hz;
};

/// Ratios 0.1 ... 10, resonances from 0.025/lag to 0.9 of the Nyquist frequency, as in the golden file.
std::vector<Split> all_splits() {
  std::vector<Split> all;
  constexpr int kResonances = 16;
  const double low = 0.025 / kLag, high = 0.9 * 0.5 / kStep;
  for (const double ratio : {0.1, 0.3, 1.0, 3.0, 10.0})
    for (int i = 0; i < kResonances; ++i)
      all.push_back({ratio, low * std::pow(high / low, i / (kResonances - 1.0))});
  return all;
}

Machine machine_of(const Split& split, double zeta) {
  const double motor = kTotal / (1.0 + split.ratio), load = kTotal - motor;
  const double omega = 2.0 * std::numbers::pi * split.resonance_hz, reduced = motor * load / kTotal;
  return test::golden_machine({motor, load, omega * omega * reduced, 2.0 * zeta * omega * reduced}, kStep,
                              kDelay);
}

/// `controller_of(motor inertia)`
template <class ControllerOf>
double unstable_share(double zeta, const ControllerOf& controller_of) {
  const auto splits = all_splits();
  int unstable = 0;
  for (const Split& split : splits) {
    const FilteredPi controller = controller_of(kTotal / (1.0 + split.ratio));
    unstable +=
        !closed_loop(machine_of(split, zeta).states(), states_of(controller, kStep)).is_stable() ? 1 : 0;
  }
  return unstable / static_cast<double>(splits.size());
}

UnknownMachine known(double motor) {
  UnknownMachine machine;
  machine.motor_inertia = motor;
  machine.total_inertia = kTotal;
  machine.delay_s = kDelay;
  machine.sample_time_s = kStep;
  return machine;
}

TEST(GoldenFirstLoop, SharesOfUnstableMachines) {
  const auto golden = test::golden_json("e_tune_structures.json").at("first_tune").at("unstable_share");
  for (const char* inertia : {"motor", "total"}) {
    for (const auto& [crossover, row] : golden.at(inertia).items()) {
      for (const auto& [zeta, share] : row.items()) {
        SCOPED_TRACE(std::string(inertia) + " w1 lag/(2 pi) " + crossover + ", zeta " + zeta);
        const double least_damping = 2.0 * std::stod(crossover);  // w1 lag/(2 pi) = zeta_min/2
        const auto found = unstable_share(std::stod(zeta), [&](double motor) {
          UnknownMachine machine = known(std::string(inertia) == "motor" ? motor : kTotal);
          machine.least_damping = least_damping;
          return first_loop(machine).value();
        });
        EXPECT_NEAR(found, share.get<double>(), 1e-9);
      }
    }
  }
}

TEST(FirstLoop, NoneIsUnstableFromTheLeastDampingOn) {
  for (const double least : {0.005, 0.01, 0.02, 0.05, 0.1})
    for (const double zeta : {least, 2.0 * least})
      EXPECT_EQ(unstable_share(zeta,
                               [&](double motor) {
                                 UnknownMachine machine = known(motor);
                                 machine.least_damping = least;
                                 return first_loop(machine).value();
                               }),
                0.0)
          << least << " " << zeta;
}

/// Without the motor's inertia: the total one over 1 + R_max.
TEST(FirstLoop, TheLargestRatioMakesTheTotalInertiaSafe) {
  const auto by_ratio = [](double) {
    UnknownMachine machine = known(1.0);
    machine.motor_inertia.reset();
    machine.largest_ratio = 10.0;
    return first_loop(machine).value();
  };
  EXPECT_EQ(unstable_share(0.01, by_ratio), 0.0);
  EXPECT_NEAR(by_ratio(0.0).kp, kTotal / 11.0 * std::numbers::pi * 0.01 / kLag, 1e-12);
}

TEST(FirstLoop, RefusesWhatIsNotSafe) {
  UnknownMachine machine = known(0.01);
  machine.motor_inertia.reset();
  EXPECT_EQ(first_loop(machine).error().field, "motor_inertia");  // the total inertia alone
  machine = known(0.01);
  machine.total_inertia.reset();
  EXPECT_EQ(first_loop(machine).error().field, "total_inertia");
  machine.largest_ratio = 4.0;
  EXPECT_NEAR(first_loop(machine)->ki, std::pow(first_loop(machine)->kp, 2) / (6.0 * 0.05), 1e-12);
  machine.total_inertia = 0.001;  // less than the motor's
  EXPECT_EQ(first_loop(machine).error().field, "total_inertia");
  machine = known(0.01);
  machine.largest_ratio = 4.0;  // a third value, which may contradict
  EXPECT_EQ(first_loop(machine).error().field, "largest_ratio");
  machine = known(0.01);
  machine.sample_time_s = 0.0;
  EXPECT_EQ(first_loop(machine).error().field, "sample_time_s");
}

TEST(FirstLoop, TotalInertiaWithoutFriction) {
  constexpr double kFriction = 0.7, kInertia = 0.05;
  EXPECT_NEAR(total_inertia_of(kInertia * 20.0 + kFriction, 20.0, -kInertia * 10.0 + kFriction, -10.0),
              kInertia, 1e-15);
}

}  // namespace
}  // namespace resonid::design
