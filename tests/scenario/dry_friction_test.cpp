// SPDX-License-Identifier: MIT
// Dry friction, from records of simulated machines that stick and slide; the truth is that of the simulation.
#include <algorithm>
#include <array>
#include <cmath>
#include <experiments.hpp>
#include <moving_axis.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/io/shipped_experiments.hpp>

namespace resonid {
namespace {

using identification::Result;

/// 20 s of PRBS, strong enough that the machine turns back some thousand times.
plant::ExperimentConfig turning_back(double coulomb, std::uint64_t seed) {
  auto c = test::published_drive(0.05, 0.0, seed);
  c.drive.viscous_friction = 0.05;
  c.friction.driven.coulomb = coulomb;
  c.excitation.kind = online::Kind::prbs;
  c.excitation.amplitude = 2.1;
  c.excitation.register_length = 12;
  c.run.duration_s = 20.0;
  return c;
}

Result result_of(const plant::ExperimentConfig& c) {
  return test::identified(test::simulated(c).record, test::known(c));
}

void expect_near(const data::Estimate& e, double truth) { EXPECT_NEAR(e.value, truth, 3.5 * e.std); }

TEST(DryFriction, IsToldFromViscousFriction) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto result = result_of(turning_back(0.3, seed));
    ASSERT_TRUE(result.model && result.model->coulomb_friction) << "seed " << seed;
    const auto& drive = result.model->drive;
    expect_near(*result.model->coulomb_friction, 0.3);
    expect_near(drive.estimate(fit::kDrivenInertia), 0.032);
    expect_near(drive.estimate(fit::kLoadInertia), 0.032);
    expect_near(drive.estimate(fit::kStiffness), 143.75);
    EXPECT_FALSE(result.model->further_friction.any()) << "seed " << seed;
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
  expect_near(*result.model->coulomb_friction, 0.3);
}

/// The noise is white at first and coloured after: what is simulated with friction then has states of its
/// own.
TEST(DryFriction, BearsANoiseModelThatComesLate) {
  auto c =
      test::loop_of_two_masses(2.3731556e-4, 3.2434761e-4, 930.47714, 0.028683553, 0.23526892, 0.014323945);
  c.measurement.delay_s = 0.00025;
  c.measurement.noise_rms = 0.041299255;
  c.excitation.kind = online::Kind::chirp;
  c.excitation.sweep = online::Sweep::logarithmic;
  c.excitation.from_hz = 44.927927;
  c.excitation.to_hz = 1036.7702;
  c.excitation.duration_s = 0.92741129;
  c.excitation.repeat = false;
  c.friction.driven.coulomb = 0.14142136;
  c.run.sample_rate_hz = 4000.0;
  c.run.duration_s = 0.92741129;
  c.run.seed = 100;
  fit::OutputErrorConfig config;
  config.initial.structure = fit::Structure::two_mass;
  config.initial.parameters = {0.000237 * 1.01, 0.000324 / 1.01, 930.0 * 1.01, 0.0287 * 1.01, 0.0};
  config.initial.sample_time_s = 1.0 / c.run.sample_rate_hz;
  config.coulomb_friction = true;
  config.known_delay_s = c.measurement.delay_s;
  const auto fit = fit::fit_output_error(test::simulated(c).record, config);
  ASSERT_TRUE(fit && fit->converged && fit->coulomb_friction);
  EXPECT_GT(fit->noise.order(), 0U);
  expect_near(*fit->coulomb_friction, 0.14142136);
  expect_near(fit->model.estimate(fit::kStiffness), 930.47714);
}

TEST(DryFriction, IsNotFoundWhereThereIsNone) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    const auto result = result_of(turning_back(0.0, seed));
    ASSERT_TRUE(result.model.has_value());
    EXPECT_FALSE(result.model->has_dry_friction()) << "seed " << seed;
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

/// From a start next to the truth, as a response gives it.
fit::OutputErrorConfig near_truth(const plant::ExperimentConfig& c) {
  fit::OutputErrorConfig config;
  config.initial.structure = fit::Structure::two_mass;
  auto& p = config.initial.parameters;
  p.driven_inertia = 1.01 * 0.032;
  p.load_inertia = 0.99 * 0.032;
  p.stiffness = 143.75;
  p.damping = 0.3;
  p.viscous_friction = 0.05;
  config.viscous_friction = config.coulomb_friction = true;
  config.known_delay_s = c.measurement.delay_s;
  return config;
}

fit::OutputErrorFit fitted(const plant::ExperimentConfig& c) {
  auto fit = fit::fit_output_error(test::simulated(c).record, near_truth(c));
  if (!fit) throw std::runtime_error("fit refused");
  return std::move(*fit);
}

/// What is lacking most, of the fit with Coulomb friction on the driven side.
struct Extension {
  fit::LackingFriction lacking;
  double bic = 0.0;                 ///< Without it.
  fit::JointOutputErrorFit fitted;  ///< With it, from what the test says.
};
Extension extension_of(const data::Record& record, fit::OutputErrorConfig config) {
  const auto simple = fit::fit_output_error(std::span(&record, 1), config);
  if (!simple || simple->lacking_friction.empty()) throw std::runtime_error("no fit");
  const auto& all = simple->lacking_friction;
  Extension found;
  found.lacking =
      *std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.gain < b.gain; });
  found.bic = simple->bic;
  config.initial = simple->model;
  config.coulomb_start = found.lacking.coulomb_start;
  config.further_friction = found.lacking.start;
  auto wider = fit::fit_output_error(std::span(&record, 1), config);
  if (!wider) throw std::runtime_error("fit refused");
  found.fitted = std::move(*wider);
  return found;
}
Extension extension_of(const plant::ExperimentConfig& c) {
  return extension_of(test::simulated(c).record, near_truth(c));
}

/// To and fro.
Extension extension_of(const test::MovingAxis& m, unsigned seed) {
  fit::OutputErrorConfig config;
  config.initial.structure = fit::Structure::rigid;
  config.initial.parameters.driven_inertia = 1.02 * m.inertia;
  config.viscous_friction = config.coulomb_friction = true;
  config.known_delay_s = static_cast<double>(m.late) / m.rate_hz;
  return extension_of(test::simulated(m, seed, data::OutputQuantity::velocity), config);
}

TEST(DryFriction, OnTheLoadIsFoundBesideThatOnTheMotor) {
  auto c = turning_back(0.2, 1);
  c.run.duration_s = 10.0;
  c.friction.load.coulomb = 0.15;
  const auto found = extension_of(c);
  ASSERT_TRUE(found.lacking.start.load_coulomb.has_value());
  ASSERT_TRUE(found.fitted.converged && found.fitted.further_friction.load_coulomb);
  EXPECT_LT(found.fitted.bic, found.bic - 100.0);
  expect_near(*found.fitted.further_friction.load_coulomb, 0.15);
  expect_near(*found.fitted.coulomb_friction, 0.2);
  expect_near(found.fitted.model.estimate(fit::kLoadInertia), 0.032);
  EXPECT_LT(found.fitted.further_friction.load_coulomb->std, 0.05 * 0.15);
}

TEST(DryFriction, ThatFallsWithTheSpeedIsFound) {
  constexpr int kSeeds = 2;
  test::MovingAxis axis;
  axis.breakaway = 0.3;
  axis.stribeck = 0.8;
  const std::array<double, 5> truth = {axis.inertia, axis.viscous, 0.5, 0.8, 0.8};
  double square = 0.0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto found = extension_of(axis, seed);
    ASSERT_TRUE(found.lacking.start.breakaway.has_value());
    const auto& further = found.fitted.further_friction;
    ASSERT_TRUE(found.fitted.converged && further.breakaway && further.stribeck_velocity) << "seed " << seed;
    EXPECT_LT(found.fitted.bic, found.bic - 100.0);
    const std::array<data::Estimate, 5> estimates = {
        found.fitted.model.estimate(fit::kDrivenInertia), found.fitted.model.estimate(fit::kViscousFriction),
        *found.fitted.coulomb_friction, *further.breakaway, *further.stribeck_velocity};
    for (std::size_t i = 0; i < truth.size(); ++i) {
      EXPECT_LT(estimates[i].std, 0.1 * truth[i]) << i;
      square += std::pow((estimates[i].value - truth[i]) / estimates[i].std, 2);
    }
  }
  // Of ten squares, dependent ones among them, a mean beyond 2.5 is left by chance about once in 100 times.
  EXPECT_LT(square / (kSeeds * 5.0), 2.5);
}

/// Two sizes are their mean and a constant torque: no more is there to be found.
TEST(DryFriction, OfTwoSizesIsTheirMeanAndAnOffset) {
  test::MovingAxis axis;
  axis.back = 0.7;
  const auto found = extension_of(axis, 1);
  EXPECT_LT(found.lacking.gain, 16.0);
  EXPECT_NEAR(found.lacking.coulomb_start, 0.6, 0.005);
}

/// Chi-square of one degree of freedom, the largest of five: 16 is beyond a chance of 1 in 3000.
TEST(DryFriction, LacksNothingMoreWhereThereIsNone) {
  auto c = turning_back(0.2, 1);
  c.run.duration_s = 10.0;
  EXPECT_LT(extension_of(c).lacking.gain, 16.0);
}

/// The sum of 16 squared deviations in units of their bars is chi-square distributed: an rms of 0.5 ... 1.5
/// is left by chance once in 250 times.
TEST(DryFriction, ErrorBarsHold) {
  constexpr int kSeeds = 16;
  const char* const names[] = {"J1", "J2", "K", "D", "viscous friction", "Tc", "offset"};
  const std::array<double, 7> truth = {0.032, 0.032, 143.75, 0.3, 0.05, 0.3, 0.1};
  std::array<double, 7> squares{};
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    auto c = turning_back(0.3, seed);
    c.run.duration_s = 10.0;
    c.disturbance.load_torque = 0.1;
    const auto fit = fitted(c);
    ASSERT_TRUE(fit.converged && fit.coulomb_friction && fit.offset) << "seed " << seed;
    const std::array<data::Estimate, 7> found = {fit.model.estimate(fit::kDrivenInertia),
                                                 fit.model.estimate(fit::kLoadInertia),
                                                 fit.model.estimate(fit::kStiffness),
                                                 fit.model.estimate(fit::kDamping),
                                                 fit.model.estimate(fit::kViscousFriction),
                                                 *fit.coulomb_friction,
                                                 *fit.offset};
    for (std::size_t i = 0; i < truth.size(); ++i)
      squares[i] += std::pow((found[i].value - truth[i]) / found[i].std, 2);
  }
  for (std::size_t i = 0; i < truth.size(); ++i) {
    EXPECT_GT(std::sqrt(squares[i] / kSeeds), 0.5) << names[i];
    EXPECT_LT(std::sqrt(squares[i] / kSeeds), 1.5) << names[i];
  }
}

/// One more of each, all the way: chosen, right, trusted.
TEST(DryFriction, OfTheLoadAloneIsTold) {
  auto c = turning_back(0.0, 1);
  c.run.duration_s = 10.0;
  c.friction.load.coulomb = 0.3;
  const auto result = result_of(c);
  ASSERT_TRUE(result.model && result.model->further_friction.load_coulomb);
  EXPECT_FALSE(result.model->coulomb_friction.has_value());
  expect_near(*result.model->further_friction.load_coulomb, 0.3);
  expect_near(result.model->drive.estimate(fit::kLoadInertia), 0.032);
  EXPECT_TRUE(result.trusted);
}

/// What sampling leaves of the plant's own motion, which sticks and turns back between samples.
TEST(DryFriction, IsExactWithoutNoise) {
  auto c = turning_back(0.3, 1);
  c.measurement.noise_rms = 0.0;
  const auto fit = fitted(c);
  ASSERT_TRUE(fit.coulomb_friction.has_value());
  EXPECT_NEAR(fit.coulomb_friction->value, 0.3, 0.01 * 0.3);
  EXPECT_NEAR(fit.model.parameters.viscous_friction, 0.05, 0.005);
  EXPECT_NEAR(fit.model.parameters.driven_inertia, 0.032, 0.001 * 0.032);
  EXPECT_NEAR(fit.model.parameters.stiffness, 143.75, 0.002 * 143.75);
}

/// Machines in motion: the averages over periods of the excitation take the motion for noise.
TEST(MachinesInMotion, ServoAxisWithLimitsAndFriction) {
  const auto c = io::shipped_experiment("servo_cascade");
  const auto result = test::identified(test::simulated(c).record, {});
  EXPECT_EQ(result.method, "local-polynomial");
  ASSERT_TRUE(result.model && result.model->coulomb_friction);
  const auto& drive = result.model->drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  EXPECT_NEAR(drive.parameters.driven_inertia, 0.0012, 0.05 * 0.0012);
  EXPECT_NEAR(drive.parameters.load_inertia, 0.0030, 0.03 * 0.0030);
  EXPECT_NEAR(drive.parameters.stiffness, 600.0, 0.03 * 600.0);
  expect_near(drive.estimate(fit::kDrivenInertia), 0.0012);
  expect_near(drive.estimate(fit::kLoadInertia), 0.0030);
  expect_near(drive.estimate(fit::kStiffness), 600.0);
  EXPECT_NEAR(result.model->coulomb_friction->value, 0.05, 0.01);
  EXPECT_TRUE(result.trusted);
}

/// What the record alone makes of the lag is a delay, which costs the stiffness 1.4 %. Told, the figures
/// hold.
TEST(MachinesInMotion, ServoAxisWhoseLagIsToldHoldsItsErrorBars) {
  const auto c = io::shipped_experiment("servo_cascade");
  identification::Options options;
  options.model = identification::ModelChoice::two_mass;
  options.delay_s = c.measurement.delay_s;
  options.torque_lag_s = c.actuator.lag_s;
  const auto result = test::identified(test::simulated(c).record, options);
  ASSERT_TRUE(result.model);
  const auto& drive = result.model->drive;
  expect_near(drive.estimate(fit::kDrivenInertia), 0.0012);
  expect_near(drive.estimate(fit::kLoadInertia), 0.0030);
  expect_near(drive.estimate(fit::kStiffness), 600.0);
  EXPECT_LT(drive.estimate(fit::kStiffness).std, 0.01 * 600.0);
}

/// Stribeck friction on both sides, sticking at every reversal: what is fitted is simpler.
TEST(MachinesInMotion, ReversalsWithFriction) {
  const auto c = io::shipped_experiment("friction_reversal");
  const auto result = test::identified(test::simulated(c).record, {});
  ASSERT_TRUE(result.model && result.model->coulomb_friction);
  const auto& drive = result.model->drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  EXPECT_NEAR(drive.parameters.driven_inertia, 0.032, 0.06 * 0.032);
  EXPECT_NEAR(drive.parameters.load_inertia, 0.032, 0.06 * 0.032);
  EXPECT_NEAR(drive.parameters.stiffness, 143.75, 0.05 * 143.75);
  EXPECT_NEAR(drive.resonance().value, 15.09, 0.01 * 15.09);
  // Bars of a fiftieth of a per cent do not hold what the simpler model misses: then the result must say so.
  EXPECT_FALSE(result.trusted);
  EXPECT_TRUE(test::finding(result, "changes-within-recording") ||
              test::finding(result, "differs-over-frequency"));
}

}  // namespace
}  // namespace resonid
