// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <moving_axis.hpp>

namespace resonid::fit {
namespace {

/// Error bars over 60 seeds: 95 % intervals cover 85 % at least (0.1 % limit of 60 seeds at 95 %), and the
/// rms of error over bar is neither above 1.35 nor below 0.4.
void expect_coverage(const test::MovingAxis& machine, data::OutputQuantity quantity) {
  constexpr unsigned kSeeds = 60;
  std::array<double, 4> squares{};
  std::array<int, 4> inside{};
  for (unsigned seed = 101; seed <= 100 + kSeeds; ++seed) {
    const auto found = fit_inverse_dynamics(test::simulated(machine, seed, quantity), test::told(machine));
    ASSERT_TRUE(found.has_value() && found->coulomb_friction);
    const auto off = test::deviations(machine, *found);
    for (std::size_t i = 0; i < off.size(); ++i) {
      squares[i] += off[i] * off[i] / kSeeds;
      inside[i] += std::abs(off[i]) < 1.96 ? 1 : 0;
    }
  }
  for (std::size_t i = 0; i < squares.size(); ++i) {
    EXPECT_LT(std::sqrt(squares[i]), 1.35) << i;
    EXPECT_GT(std::sqrt(squares[i]), 0.4) << i;
    EXPECT_GE(inside[i], static_cast<int>(0.85 * kSeeds)) << i;
  }
}

TEST(InverseDynamicsCoverage, Velocity) { expect_coverage({}, data::OutputQuantity::velocity); }
TEST(InverseDynamicsCoverage, Position) { expect_coverage({}, data::OutputQuantity::position); }

TEST(InverseDynamicsCoverage, AsymmetricFriction) {
  test::MovingAxis machine;
  machine.forth = 0.8;
  machine.back = 0.3;
  machine.noise = 0.05;
  expect_coverage(machine, data::OutputQuantity::velocity);
}

TEST(InverseDynamicsCoverage, SlowSampling) {
  test::MovingAxis machine;
  machine.rate_hz = 400.0;
  machine.late = 1;
  machine.duration_s = 10.0;
  expect_coverage(machine, data::OutputQuantity::velocity);
}

}  // namespace
}  // namespace resonid::fit
