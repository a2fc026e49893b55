// SPDX-License-Identifier: MIT
// Dry friction, from records of simulated machines that stick and slide; the truth is that of the simulation.
#include <experiments.hpp>
#include <resonid/reproduction/experiments.hpp>

namespace resonid {
namespace {

using identification::Result;

/// 20 s of PRBS, strong enough that the machine turns back some thousand times.
plant::ExperimentConfig turning_back(double coulomb, std::uint64_t seed) {
  auto c = test::published_drive(0.05, 0.0, seed);
  c.drive.viscous_friction = 0.05;
  c.friction.driven.coulomb = coulomb;
  c.excitation.kind = excitation::Kind::prbs;
  c.excitation.amplitude = 2.1;
  c.excitation.register_length = 12;
  c.run.duration_s = 20.0;
  return c;
}

Result result_of(const plant::ExperimentConfig& c) {
  return test::identified(test::simulated(c).record, test::known(c));
}

/// Within three standard deviations and the share that the sampling of sticking leaves in doubt.
void expect_near(const fit::Estimate& e, double truth, double share) {
  EXPECT_NEAR(e.value, truth, 3.0 * e.standard_deviation + share * truth);
}

TEST(DryFriction, IsToldFromViscousFriction) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto result = result_of(turning_back(0.3, seed));
    ASSERT_TRUE(result.model && result.model->coulomb_friction) << "seed " << seed;
    const auto& drive = result.model->drive;
    expect_near(*result.model->coulomb_friction, 0.3, 0.02);
    expect_near(drive.estimate(fit::kDrivenInertia), 0.032, 0.01);
    expect_near(drive.estimate(fit::kLoadInertia), 0.032, 0.01);
    expect_near(drive.estimate(fit::kStiffness), 143.75, 0.01);
    EXPECT_LT(drive.parameters.viscous_friction, 0.12);  // 0.96 in a fit without dry friction
    EXPECT_TRUE(result.trusted);
  }
}

TEST(DryFriction, OfARigidMachineIsFound) {
  auto c = turning_back(0.3, 1);
  c.drive.structure = plant::Structure::rigid;
  const auto result = result_of(c);
  ASSERT_TRUE(result.model && result.model->coulomb_friction);
  EXPECT_EQ(result.model->drive.structure, fit::Structure::rigid);
  expect_near(*result.model->coulomb_friction, 0.3, 0.03);
}

TEST(DryFriction, IsNotFoundWhereThereIsNone) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto result = result_of(turning_back(0.0, seed));
    ASSERT_TRUE(result.model.has_value());
    EXPECT_FALSE(result.model->coulomb_friction.has_value()) << "seed " << seed;
    EXPECT_NEAR(result.model->drive.parameters.viscous_friction, 0.05, 0.01);
  }
}

TEST(DryFriction, CanBeAskedForAndForbidden) {
  const auto c = turning_back(0.3, 1);
  const auto record = test::simulated(c).record;
  auto options = test::known(c);
  options.friction = identification::Friction::viscous;
  const auto without = test::identified(record, options);
  ASSERT_TRUE(without.model.has_value());
  EXPECT_FALSE(without.model->coulomb_friction.has_value());
  options.friction = identification::Friction::dry;
  const auto alone = test::identified(record, options);
  ASSERT_TRUE(alone.model && alone.model->coulomb_friction);
  EXPECT_FALSE(alone.model->drive.estimated[fit::kViscousFriction]);
}

/// Machines in motion: the averages over periods of the excitation take the motion for noise.
TEST(MachinesInMotion, ServoAxisWithLimitsAndFriction) {
  const auto c = reproduction::shipped_experiment("servo_cascade");
  const auto result = test::identified(test::simulated(c).record, {});
  EXPECT_EQ(result.method, "local-polynomial");
  ASSERT_TRUE(result.model && result.model->coulomb_friction);
  const auto& drive = result.model->drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  EXPECT_NEAR(drive.parameters.driven_inertia, 0.0012, 0.05 * 0.0012);
  EXPECT_NEAR(drive.parameters.load_inertia, 0.0030, 0.03 * 0.0030);
  EXPECT_NEAR(drive.parameters.stiffness, 600.0, 0.03 * 600.0);
  EXPECT_NEAR(result.model->coulomb_friction->value, 0.05, 0.01);
  EXPECT_TRUE(result.trusted);
}

/// Stribeck friction on both sides, sticking at every reversal: what is fitted is simpler.
TEST(MachinesInMotion, ReversalsWithFriction) {
  const auto c = reproduction::shipped_experiment("friction_reversal");
  const auto result = test::identified(test::simulated(c).record, {});
  ASSERT_TRUE(result.model && result.model->coulomb_friction);
  const auto& drive = result.model->drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  EXPECT_NEAR(drive.parameters.driven_inertia, 0.032, 0.06 * 0.032);
  EXPECT_NEAR(drive.parameters.load_inertia, 0.032, 0.06 * 0.032);
  EXPECT_NEAR(drive.parameters.stiffness, 143.75, 0.05 * 143.75);
  EXPECT_NEAR(drive.resonance().value, 15.09, 0.01 * 15.09);
  EXPECT_TRUE(result.trusted);
}

}  // namespace
}  // namespace resonid
