// SPDX-License-Identifier: MIT
// Drives of other kinds than the published one: identify() finds what was simulated, and says so when nothing
// can be found.
#include <fmt/format.h>

#include <experiments.hpp>
#include <nlohmann/json.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <resonid/plant/detail/white_noise.hpp>
#include <resonid/report/json.hpp>

namespace resonid {
namespace {

plant::ExperimentConfig rigid_drive(std::uint64_t seed) {
  auto c = test::published_drive(0.1, 0.0, seed);
  c.drive = {};
  c.drive.structure = plant::Structure::rigid;
  c.drive.driven_inertia = 0.064;
  c.drive.viscous_friction = 0.05;
  return c;
}

void expect_rigid(const plant::ExperimentConfig& experiment) {
  const auto result = test::identified(test::simulated(experiment).record, test::known(experiment));
  EXPECT_TRUE(result.trusted);
  EXPECT_TRUE(result.modes.empty());
  ASSERT_TRUE(result.model);
  EXPECT_EQ(result.model->drive.structure, fit::Structure::rigid);
  test::expect_within(result.model->drive.estimate(fit::kDrivenInertia), 0.064, 4.5, 0.05);
}

TEST(RigidDrive, ComesOutRigidUnderASweep) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto experiment = rigid_drive(seed);
    test::sweep(experiment);
    SCOPED_TRACE(seed);
    expect_rigid(experiment);
  }
}

TEST(RigidDrive, ComesOutRigidUnderAPrbs) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto experiment = rigid_drive(seed);
    test::prbs(experiment);
    SCOPED_TRACE(seed);
    expect_rigid(experiment);
  }
}

TEST(Noise, UnrelatedSignalsAreNotTrusted) {
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    data::Record record;
    record.source = "noise";
    record.sample_rate_hz = 500.0;
    record.input = {"u", "Nm", {}};
    record.output = {"y", "rad/s", {}};
    plant::WhiteNoise input(seed, 1.0), output(100 + seed, 1.0);
    for (int k = 0; k < 4000; ++k) {
      record.input.samples.push_back(input.step());
      record.output.samples.push_back(output.step());
    }
    const auto result = test::identified(record, {});
    EXPECT_FALSE(result.trusted) << seed;
    EXPECT_NE(test::finding(result, "incoherent"), nullptr) << seed;
    EXPECT_TRUE(result.modes.empty()) << seed;
  }
}

TEST(TwoMassDrive, ViscousFrictionIsFound) {
  auto experiment = test::published_drive(0.02);
  experiment.drive.viscous_friction = 0.2;
  test::prbs(experiment);
  const auto result = test::identified(test::simulated(experiment).record, test::known(experiment));
  EXPECT_TRUE(result.trusted);
  const auto& drive = result.model.value().drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  ASSERT_TRUE(drive.estimated[fit::kViscousFriction]);
  test::expect_within(drive.estimate(fit::kViscousFriction), 0.2, 4.0, 0.05);
  test::expect_within(drive.estimate(fit::kDrivenInertia), 0.032, 4.0, 0.02);
  test::expect_within(drive.estimate(fit::kStiffness), 143.75, 4.0, 0.02);
}

/// At these frequencies both masses turn together: the record tells all of the friction and not where it
/// acts.
TEST(TwoMassDrive, FrictionThatTheRecordDoesNotDivideIsTheMotors) {
  auto experiment = io::shipped_experiment("shaft_drive");
  experiment.run.seed = 307070094;  // the load's alone is the likelier, by a factor of 1.3
  const auto result = test::identified(test::simulated(experiment).record, test::known(experiment));
  EXPECT_TRUE(result.trusted);
  const auto& drive = result.model.value().drive;
  ASSERT_TRUE(drive.estimated[fit::kViscousFriction]);
  EXPECT_FALSE(drive.estimated[fit::kLoadViscousFriction]);
  test::expect_within(drive.estimate(fit::kViscousFriction), 0.001, 4.0, 0.1);
}

TEST(TwoMassDrive, FrictionThatIsClearlyTheLoadsIsTheLoads) {
  auto experiment = test::published_drive(0.02);
  experiment.drive.load_viscous_friction = 0.2;
  test::prbs(experiment);
  const auto result = test::identified(test::simulated(experiment).record, test::known(experiment));
  EXPECT_TRUE(result.trusted);
  const auto& drive = result.model.value().drive;
  ASSERT_TRUE(drive.estimated[fit::kLoadViscousFriction]);
  test::expect_within(drive.estimate(fit::kLoadViscousFriction), 0.2, 4.0, 0.05);
  if (drive.estimated[fit::kViscousFriction]) {
    const auto motor = drive.estimate(fit::kViscousFriction);
    EXPECT_LT(std::abs(motor.value), 4.0 * motor.std);
  }
}

/// Which side the spring holds, only damping and friction tell: loads of 0.032 and 0.045 kgm2 come out alike.
void expect_the_right_side_or_none(double noise_rms, std::size_t fewest_trusted, std::size_t fewest_refused) {
  std::size_t trusted = 0, refused = 0;
  for (const auto side : {fit::kMotorGroundStiffness, fit::kLoadGroundStiffness})
    for (const std::uint64_t seed :
         {1U, 4U}) {  // of 4 the motion seems to take less inertia, which the spring explains
      auto experiment = test::published_drive(noise_rms, 0.0, seed);
      (side == fit::kMotorGroundStiffness ? experiment.drive.motor_ground_stiffness
                                          : experiment.drive.load_ground_stiffness) = 20.0;
      test::prbs(experiment);
      SCOPED_TRACE(fmt::format("{} {}", side == fit::kMotorGroundStiffness ? "motor" : "load", seed));
      const auto options = test::known(experiment);
      const auto record = test::simulated(experiment).record;
      const auto result = test::identified(record, options);
      ASSERT_TRUE(result.model);
      const auto& drive = result.model->drive;
      if (result.trusted) {
        ++trusted;
        EXPECT_TRUE(drive.estimated[side]);
        test::expect_within(drive.estimate(fit::kLoadInertia), 0.032, 4.0, 0.1);
        test::expect_within(drive.estimate(fit::kStiffness), 143.75, 4.0, 0.1);
        continue;
      }
      ++refused;
      EXPECT_NE(test::finding(result, "ground-side"), nullptr);
      EXPECT_FALSE(result.reliable.parameters);
      EXPECT_TRUE(result.reliable.resonances);
      auto told = options;
      told.ground =
          side == fit::kMotorGroundStiffness ? identification::Ground::motor : identification::Ground::load;
      const auto better = test::identified(record, told);
      EXPECT_TRUE(better.trusted);
      test::expect_within(better.model.value().drive.estimate(fit::kLoadInertia), 0.032, 4.0, 0.1);
    }
  EXPECT_GE(trusted, fewest_trusted) << refused;
  EXPECT_GE(refused, fewest_refused) << trusted;
}

TEST(TwoMassDrive, SideOfASpringToTheGroundIsTold) { expect_the_right_side_or_none(0.02, 4, 0); }

TEST(TwoMassDrive, SideOfASpringToTheGroundThatNoiseHidesIsNotGuessed) {
  expect_the_right_side_or_none(0.1, 0, 1);
}

/// The motor holds a constant load that no column tells of.
TEST(TwoMassDrive, UnknownLoadTorqueDoesNoHarm) {
  auto experiment = test::published_drive(0.02, 10.0);
  test::prbs(experiment);
  auto record = test::simulated(experiment).record;
  for (double& u : record.input.samples) u += 0.7;
  const auto result = test::identified(record, test::known(experiment));
  EXPECT_TRUE(result.trusted);
  const auto& model = result.model.value();
  ASSERT_TRUE(model.offset);
  EXPECT_NEAR(model.offset->value, -0.7, 4.0 * model.offset->std + 1e-3);
  test::expect_within(model.drive.estimate(fit::kLoadInertia), 0.032, 4.0, 0.02);
  test::expect_within(model.drive.resonance(), 15.0857, 4.0, 0.01);
}

TEST(TwoMassDrive, DelayThatNobodyToldIsFound) {
  auto experiment = test::published_drive(0.02);
  test::prbs(experiment);
  auto options = test::known(experiment);
  options.delay_s = 0.0;
  const auto simulation = test::simulated(experiment);
  const auto result = test::identified(simulation.record, options);
  EXPECT_TRUE(result.trusted);
  const auto* delay = test::finding(result, "further-delay");
  ASSERT_NE(delay, nullptr);
  EXPECT_NEAR(delay->value.value(), 0.004, 2e-4);
  EXPECT_NE(delay->meaning.find("ms"), std::string::npos);
  EXPECT_NEAR(result.modes.at(1).frequency_hz.value, 15.0857, 0.1);
  // and part of the margins: the same as when it is given
  const auto told = test::identified(simulation.record, test::known(experiment));
  EXPECT_EQ(test::finding(told, "further-delay"), nullptr);
  EXPECT_NEAR(result.loop->margins.phase_margin_deg().value(), told.loop->margins.phase_margin_deg().value(),
              0.5);
}

/// With the controller known the excitation follows from the input; without, the loop is identified directly.
TEST(TwoMassDrive, IsIdentifiedWithoutAnExcitationSignalToo) {
  auto experiment = test::published_drive(0.01);
  test::prbs(experiment);
  auto record = test::simulated(experiment).record;
  record.excitation = {};
  auto options = test::known(experiment);
  for (const char* approach : {"joint", "direct"}) {
    const auto result = test::identified(record, options);
    EXPECT_EQ(result.approach, approach);
    EXPECT_TRUE(result.trusted);
    EXPECT_NEAR(result.modes.at(1).frequency_hz.value, 15.0857, 0.1);
    options.controller.reset();
  }
}

/// 250 samples, nothing told: no response of them shows the resonance, the fit to the record does.
TEST(TwoMassDrive, HalfASecondIsEnough) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto experiment = test::published_drive(0.1, 10.0, seed);
    experiment.excitation.kind = online::Kind::prbs;
    experiment.excitation.amplitude = 2.1;
    experiment.excitation.register_length = 17;
    experiment.run.duration_s = 0.5;
    const auto result = test::identified(test::simulated(experiment).record, {});
    ASSERT_EQ(result.model.value().drive.structure, fit::Structure::two_mass);
    EXPECT_TRUE(result.trusted);
    test::expect_within(result.model->drive.resonance(), 15.0857, 4.0, 0.02);
  }
}

/// What no single value describes is not trusted, and the finding says so; what obeys the model is, a lag of
/// the torque loop among it.
TEST(TwoMassDrive, IsToldFromOneThatChangesOrHasMoreToIt) {
  for (const std::uint64_t seed : {1U, 2U}) {
    auto plain = test::published_drive(0.01, 10.0, seed);
    test::prbs(plain);
    const auto conform = test::identified(test::simulated(plain).record, test::known(plain));
    EXPECT_TRUE(conform.trusted);
    EXPECT_EQ(test::finding(conform, "changes-within-recording"), nullptr);
    EXPECT_EQ(test::finding(conform, "differs-over-frequency"), nullptr);

    auto loose = plain;
    loose.disturbance.loosening = 0.05;
    loose.disturbance.loosening_at_s = 0.5 * plain.run.duration_s;
    const auto changed = test::identified(test::simulated(loose).record, test::known(loose));
    EXPECT_FALSE(changed.trusted);
    EXPECT_NE(test::finding(changed, "changes-within-recording"), nullptr);

    auto slow = plain;
    slow.actuator.lag_s = 0.002;
    const auto lagging = test::identified(test::simulated(slow).record, test::known(slow));
    EXPECT_TRUE(lagging.trusted);
    test::expect_within(lagging.model.value().drive.estimate(fit::kTorqueLag), 0.002, 4.0, 0.05);
  }
}

/// At standstill nothing holds a coupling to one side of its play. What bends the machine is named, and a
/// linear one does not have it.
TEST(TwoMassDrive, IsToldFromOneThatBends) {
  constexpr double kRadius = 0.05, kStiffness = 143.75;
  constexpr const char* kBent[] = {"backlash", "stiffening-coupling", "dry-friction", "torque-gain"};
  auto plain = test::published_drive(0.005);
  test::prbs(plain);
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    plain.run.seed = seed;
    const auto conform = test::identified(test::simulated(plain).record, test::known(plain));
    EXPECT_TRUE(conform.trusted) << seed;
    for (const auto* id : kBent) EXPECT_EQ(test::finding(conform, id), nullptr) << id << ' ' << seed;
  }
  plain.run.seed = 1;
  const double twist = 0.5 * plain.excitation.amplitude / kStiffness;  // at rest, both inertias being equal

  auto loose = plain;
  loose.drive.backlash = 0.5 * twist * kRadius;
  const auto play = test::identified(test::simulated(loose).record, test::known(loose));
  EXPECT_FALSE(play.trusted);
  EXPECT_NE(test::finding(play, "backlash"), nullptr);
  EXPECT_EQ(test::finding(play, "stiffening-coupling"), nullptr);

  auto rubber = plain;
  rubber.drive.stiffening_twist = 4.0 * twist * kRadius;
  const auto stiffening = test::identified(test::simulated(rubber).record, test::known(rubber));
  EXPECT_FALSE(stiffening.trusted);
  EXPECT_NE(test::finding(stiffening, "stiffening-coupling"), nullptr);
  EXPECT_EQ(test::finding(stiffening, "backlash"), nullptr);
}

/// A velocity that is new in every second sample only: the test takes what is new.
TEST(TwoMassDrive, PlayIsSeenInAHeldVelocityToo) {
  auto held = test::published_drive(0.005);
  test::prbs(held);
  held.measurement.hold_samples = 2;
  const auto conform = test::identified(test::simulated(held).record, test::known(held));
  EXPECT_EQ(test::finding(conform, "backlash"), nullptr);
  held.drive.backlash = 0.25 * held.excitation.amplitude / 143.75 * 0.05;
  const auto play = test::identified(test::simulated(held).record, test::known(held));
  EXPECT_FALSE(play.trusted);
  EXPECT_NE(test::finding(play, "backlash"), nullptr);
}

/// A sweep passes anti-resonance and resonance at different times: a third mass would explain a stiffness
/// that drifts.
TEST(TwoMassDrive, DriftUnderOneSweepIsNoThirdMass) {
  auto drifting = test::published_drive(0.01, 10.0);
  test::sweep(drifting);
  drifting.disturbance.stiffness_drift_per_s = 0.01;
  const auto result = test::identified(test::simulated(drifting).record, test::known(drifting));
  EXPECT_FALSE(result.trusted);
  EXPECT_NE(test::finding(result, "changes-within-recording"), nullptr);
}

/// Without being told the controller, margins come from the one that the record shows, with their error bars.
TEST(TwoMassDrive, MarginsComeFromTheControllerThatTheRecordShows) {
  auto experiment = test::published_drive(0.1, 10.0, 3);
  test::prbs(experiment);
  const auto record = test::simulated(experiment).record;
  auto options = test::known(experiment);
  const auto told = test::identified(record, options);
  options.controller.reset();
  const auto found = test::identified(record, options);
  ASSERT_TRUE(found.loop && told.loop && found.loop->crossover_std_hz);
  EXPECT_NEAR(found.loop->margins.crossover_hz().value(), told.loop->margins.crossover_hz().value(), 1e-3);
  EXPECT_NEAR(found.loop->margins.modulus_margin, told.loop->margins.modulus_margin, 1e-3);
  EXPECT_NEAR(*found.loop->crossover_std_hz / *told.loop->crossover_std_hz, 1.0, 0.05);
}

/// Carriage and load on a spring, 10 and 5 kg, f_res = sqrt(4e4 (1/10 + 1/5))/(2 pi).
TEST(LinearDrive, IsToldInKilogramsAndNewtonsPerMetre) {
  auto experiment = test::published_drive(2e-4);
  experiment.drive = {};
  experiment.drive.motion = data::Motion::linear;
  experiment.drive.driven_inertia = 10.0;
  experiment.drive.load_inertia = 5.0;
  experiment.drive.stiffness = 4e4;
  experiment.drive.damping = 50.0;
  experiment.controller.gain = 200.0;
  experiment.controller.integral_time_s = 0.2;
  test::prbs(experiment);
  const auto result = test::identified(test::simulated(experiment).record, test::known(experiment));
  EXPECT_TRUE(result.trusted);
  const auto& drive = result.model.value().drive;
  ASSERT_EQ(drive.structure, fit::Structure::two_mass);
  test::expect_within(drive.estimate(fit::kDrivenInertia), 10.0, 4.0, 0.02);
  test::expect_within(drive.estimate(fit::kLoadInertia), 5.0, 4.0, 0.02);
  EXPECT_NEAR(result.modes.at(1).frequency_hz.value, 17.4346, 0.1);
  const auto parameters = report::to_json(result).at("model").at("parameters");
  EXPECT_EQ(parameters.at("load_inertia").at("unit"), "kg");
  EXPECT_EQ(parameters.at("stiffness").at("unit"), "N/m");
  EXPECT_EQ(parameters.at("damping").at("unit"), "Ns/m");
  EXPECT_EQ(result.units.response, "(m/s)/N");
}

}  // namespace
}  // namespace resonid
