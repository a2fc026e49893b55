// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <moving_axis.hpp>

namespace resonid::fit {
namespace {

using test::MovingAxis;
using test::simulated;
using test::told;

TEST(InverseDynamics, ErrorBarsHold) {
  for (const auto quantity : {data::OutputQuantity::velocity, data::OutputQuantity::position})
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const MovingAxis machine;
      const auto found = fit_inverse_dynamics(simulated(machine, seed, quantity), told(machine));
      ASSERT_TRUE(found.has_value() && found->coulomb_friction);
      for (const double off : test::deviations(machine, *found)) EXPECT_LT(std::abs(off), 4.0) << seed;
      EXPECT_LT(found->inertia.std, 0.002 * machine.inertia);
      EXPECT_LT(found->coulomb_friction->std, 0.02 * machine.forth);
      EXPECT_GT(found->share, 0.95);
    }
}

TEST(InverseDynamics, TellsTheMeanOfAnAsymmetricFriction) {
  MovingAxis machine;
  machine.forth = 0.7;
  machine.back = 0.4;
  const auto found =
      fit_inverse_dynamics(simulated(machine, 3, data::OutputQuantity::velocity), told(machine));
  ASSERT_TRUE(found.has_value() && found->coulomb_friction);
  EXPECT_NEAR(found->coulomb_friction->value, 0.55, 4.0 * found->coulomb_friction->std);
  // The half difference brakes like a constant torque.
  EXPECT_NEAR(found->offset.value, machine.offset - 0.15, 4.0 * found->offset.std);
  EXPECT_LT(found->offset.std, 0.01);
}

TEST(InverseDynamics, FindsThatFrictionFallsWithVelocity) {
  MovingAxis machine;
  machine.breakaway = 0.4;
  machine.stribeck = 8.0;
  machine.noise = 0.005;
  const auto found =
      fit_inverse_dynamics(simulated(machine, 5, data::OutputQuantity::velocity), told(machine));
  ASSERT_TRUE(found.has_value() && found->coulomb_friction);
  EXPECT_NEAR(found->stribeck_velocity, machine.stribeck, 0.8 * machine.stribeck);
  EXPECT_GT(found->stribeck_velocity, 0.0);
  EXPECT_NEAR(found->inertia.value, machine.inertia, 4.0 * found->inertia.std);
  EXPECT_NEAR(found->inertia.value / machine.inertia, 1.0, 0.01);
}

TEST(InverseDynamics, FindsAFurtherDelay) {
  const MovingAxis machine;
  auto config = told(machine);
  config.known_delay_s = 0.0;
  const auto found = fit_inverse_dynamics(simulated(machine, 2, data::OutputQuantity::velocity), config);
  ASSERT_TRUE(found.has_value());
  EXPECT_NEAR(found->further_delay_s.value, 0.002, std::max(4.0 * found->further_delay_s.std, 2e-5));
  EXPECT_NEAR(found->inertia.value, machine.inertia, 4.0 * found->inertia.std);
}

TEST(InverseDynamics, OneDirectionTellsNoDryFriction) {
  MovingAxis machine;
  machine.away = 0.5;
  const auto found =
      fit_inverse_dynamics(simulated(machine, 1, data::OutputQuantity::velocity), told(machine));
  ASSERT_TRUE(found.has_value());
  EXPECT_FALSE(found->coulomb_friction.has_value());
  EXPECT_NEAR(found->offset.value, machine.offset - machine.forth, 4.0 * found->offset.std);
}

TEST(InverseDynamics, RefusesWhatDoesNotMove) {
  data::Record record;
  record.sample_rate_hz = 1000.0;
  record.input.samples.assign(500, 0.1);
  record.output.samples.assign(500, 0.0);
  EXPECT_FALSE(fit_inverse_dynamics(record, {}).has_value());
  std::mt19937 generator(1);
  std::normal_distribution<double> noise;
  for (auto& y : record.output.samples) y = noise(generator);
  EXPECT_FALSE(fit_inverse_dynamics(record, {}).has_value());
  record.output_quantity = data::OutputQuantity::acceleration;
  EXPECT_FALSE(fit_inverse_dynamics(record, {}).has_value());
}

}  // namespace
}  // namespace resonid::fit
