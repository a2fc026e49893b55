// SPDX-License-Identifier: MIT
// What drives have beside inertias and springs: lag of the torque loop, friction of the load, springs to the
// ground, filter of the velocity, velocities by differences.
#include <experiments.hpp>
#include <functional>
#include <loop_of_two_masses.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;

plant::ExperimentConfig servo(std::uint64_t seed) {
  auto c = test::loop_of_two_masses(0.0015, 0.0021, 270.0, 0.07, 0.06, 0.08);
  c.measurement.delay_s = 0.00075;
  c.measurement.noise_rms = 0.02;
  c.excitation.kind = online::Kind::chirp;
  c.excitation.amplitude = 0.3;
  c.excitation.from_hz = 5.0;
  c.excitation.to_hz = 400.0;
  c.excitation.duration_s = 5.0;
  c.run.sample_rate_hz = 2000.0;
  c.run.seed = seed;
  return c;
}

DriveModel model_of(const plant::ExperimentConfig& c) {
  DriveModel m;
  const auto& d = c.drive;
  m.parameters = {d.driven_inertia, d.load_inertia, d.stiffness, d.damping, d.viscous_friction};
  m.parameters.load_viscous_friction = d.load_viscous_friction;
  m.torque_lag_s = c.actuator.lag_s;
  m.output_filter_s = c.measurement.filter_s;
  m.sample_time_s = 1.0 / c.run.sample_rate_hz;
  return m;
}

constexpr std::array kFrequencies = {6.0, 40.0, 56.9, 75.0, 200.0, 390.0, 900.0};

void expect_same(const DriveModel& model, const data::FrequencyResponse& truth) {
  const auto values = model.values(kFrequencies);
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_LT(std::abs(values[i] / truth.value[i] - 1.0), 1e-8) << kFrequencies[i];
  // The transfer function says the same.
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_LT(std::abs(model.transfer_function().response(kFrequencies[i]) / truth.value[i] - 1.0), 1e-8)
        << kFrequencies[i];
}

TEST(FurtherParameters, ResponseIsThatOfTheSimulatedDrive) {
  for (const double lag_s : {0.0, 4e-6, 0.0002, 0.003})
    for (const double friction : {0.0, 0.05})
      for (const bool encoder : {false, true}) {
        SCOPED_TRACE(testing::Message() << lag_s << " " << friction << " " << encoder);
        auto c = servo(1);
        c.actuator.lag_s = lag_s;
        c.drive.load_viscous_friction = friction;
        c.measurement.filter_s = friction > 0.0 ? 0.0006 : 0.0;
        if (encoder) {
          c.measurement.velocity = plant::VelocitySource::encoder;
        }
        auto model = model_of(c);
        if (encoder) model.velocity = Velocity::differences;
        // Below a fiftieth of a sample the lag acts in proportion to itself.
        if (lag_s > 0.0 && lag_s < 1e-5) {
          const auto truth = test::simulated(c, kFrequencies).truth.response;
          const auto values = model.values(kFrequencies);
          for (std::size_t i = 0; i < values.size(); ++i)
            EXPECT_LT(std::abs(values[i] / truth.value[i] - 1.0), encoder ? 3e-3 : 2e-4);
          continue;
        }
        expect_same(model, test::simulated(c, kFrequencies).truth.response);
      }
}

/// Response of the hold, from the continuous one: sum of its images.
Complex held(const std::function<Complex(Complex)>& g, double frequency_hz, double sample_time_s) {
  constexpr int kImages = 20'000;
  Complex sum = 0.0;
  for (int k = -kImages; k <= kImages; ++k) {
    const Complex s(0.0, kTwoPi * (frequency_hz + k / sample_time_s));
    sum += g(s) * (1.0 - std::exp(-s * sample_time_s)) / (s * sample_time_s);
  }
  return sum;
}

TEST(FurtherParameters, SpringsToTheGroundGiveTheResponseOfTheirEquations) {
  for (const double motor : {0.0, 60.0})
    for (const double load : {0.0, 25.0}) {
      if (motor + load == 0.0) continue;
      auto model = model_of(servo(1));
      const auto& p = model.parameters;
      const auto two_mass = [&](Complex s) {  // impedances, torque over velocity
        const Complex far = p.load_inertia * s + load / s, between = p.damping + p.stiffness / s;
        return 1.0 / (p.driven_inertia * s + motor / s + 1.0 / (1.0 / between + 1.0 / far));
      };
      model.parameters.motor_ground_stiffness = motor;
      model.parameters.load_ground_stiffness = load;
      for (const double f : {3.0, 30.0, 57.0, 75.0, 300.0})
        EXPECT_LT(std::abs(model.response(f) / held(two_mass, f, model.sample_time_s) - 1.0), 1e-4) << f;
      auto rigid = model;
      rigid.structure = Structure::rigid;
      rigid.parameters.load_ground_stiffness = 0.0;
      if (motor == 0.0) continue;
      const auto one_mass = [&](Complex s) { return 1.0 / (p.driven_inertia * s + motor / s); };
      for (const double f : {3.0, 25.0, 75.0})
        EXPECT_LT(std::abs(rigid.response(f) / held(one_mass, f, model.sample_time_s) - 1.0), 1e-4) << f;
      ASSERT_EQ(rigid.modes().size(), 1U);
      EXPECT_NEAR(rigid.modes()[0].frequency_hz.value, std::sqrt(motor / p.driven_inertia) / kTwoPi, 1e-9);
    }
  // Both sides tied: the undamped modes are the roots of the characteristic equation.
  auto model = model_of(servo(1));
  model.parameters.motor_ground_stiffness = 60.0;
  model.parameters.load_ground_stiffness = 25.0;
  const auto& p = model.parameters;
  for (const auto& mode : model.modes()) {
    const double w2 = std::pow(kTwoPi * mode.frequency_hz.value, 2);
    const double near = p.stiffness + 60.0 - p.driven_inertia * w2,
                 far = p.stiffness + 25.0 - p.load_inertia * w2;
    EXPECT_NEAR(mode.anti ? far / p.stiffness : (near * far / p.stiffness - p.stiffness) / p.stiffness, 0.0,
                1e-9);
  }
}

/// Lines of the equations themselves, 300 of them; the lowest resonance lies in the band or below it.
TEST(FurtherParameters, ADriveOnASpringIsFoundFromItsResponseAlone) {
  for (const double ground : {4.0, 60.0})
    for (const bool of_load : {false, true}) {
      SCOPED_TRACE(testing::Message() << ground << " " << of_load);
      const auto truth = model_of(servo(1)).parameters;
      const auto drive = [&](Complex s) {
        const Complex far = truth.load_inertia * s + (of_load ? ground / s : 0.0);
        const Complex near = truth.driven_inertia * s + (of_load ? 0.0 : ground / s);
        return 1.0 / (near + 1.0 / (1.0 / (truth.damping + truth.stiffness / s) + 1.0 / far));
      };
      data::FrequencyResponse lines;
      ResponseFitConfig config;
      config.sample_time_s = 1e-5;
      config.further = {of_load ? kLoadGroundStiffness : kMotorGroundStiffness};
      for (double f = 6.0; f < 400.0; f *= 1.0145) {
        const Complex s(0.0, kTwoPi * f);  // the images are 2e-5 of this
        const Complex hold = (1.0 - std::exp(-s * config.sample_time_s)) / (s * config.sample_time_s);
        lines.frequency_hz.push_back(f);
        lines.value.push_back(drive(s) * hold);
        lines.std.push_back(0.01 * std::abs(lines.value.back()));
      }
      const auto fit = fit_response(lines, config);
      ASSERT_TRUE(fit);
      EXPECT_LT(fit->model_error, 1e-3);
      EXPECT_NEAR(fit->model.estimate(config.further[0]).value / ground, 1.0, 0.02);
      EXPECT_NEAR(fit->model.parameters.driven_inertia / truth.driven_inertia, 1.0, 0.02);
      EXPECT_NEAR(fit->model.parameters.load_inertia / truth.load_inertia, 1.0, 0.02);
      EXPECT_NEAR(fit->model.parameters.stiffness / truth.stiffness, 1.0, 0.02);
    }
}

TEST(FurtherParameters, SpringsToTheGroundAreFoundWithoutBeingNamed) {
  for (const bool of_load : {false, true}) {
    SCOPED_TRACE(of_load);
    auto c = servo(3);
    test::prbs(c);
    (of_load ? c.drive.load_ground_stiffness : c.drive.motor_ground_stiffness) = 30.0;
    const auto result = test::identified(test::simulated(c).record, test::known(c));
    EXPECT_TRUE(result.trusted);
    EXPECT_EQ(test::finding(result, "reversed"), nullptr);
    ASSERT_TRUE(result.model);
    const auto& drive = result.model->drive;
    test::expect_within(drive.estimate(of_load ? kLoadGroundStiffness : kMotorGroundStiffness), 30.0, 4.0,
                        0.1);
    EXPECT_FALSE(drive.estimated[of_load ? kMotorGroundStiffness : kLoadGroundStiffness]);
    test::expect_within(drive.estimate(kDrivenInertia), 0.0015, 4.0, 0.05);
    test::expect_within(drive.estimate(kLoadInertia), 0.0021, 4.0, 0.1);
    test::expect_within(drive.estimate(kStiffness), 270.0, 4.0, 0.1);
  }
}

TEST(FurtherParameters, AreFoundInTheRecordWhereTheyPay) {
  auto c = servo(1);
  c.actuator.lag_s = 0.0004;
  c.drive.load_viscous_friction = 0.03;
  const auto result = test::identified(test::simulated(c).record, test::known(c));
  EXPECT_TRUE(result.trusted);
  ASSERT_TRUE(result.model);
  const auto& drive = result.model->drive;
  test::expect_within(drive.estimate(kTorqueLag), 0.0004, 4.0, 0.05);
  test::expect_within(drive.estimate(kLoadViscousFriction), 0.03, 4.0, 0.1);
  test::expect_within(drive.estimate(kDrivenInertia), 0.0015, 4.0, 0.01);
  EXPECT_FALSE(drive.estimated[kDelay]);
}

TEST(FurtherParameters, AreNotFoundWhereThereAreNone) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto c = servo(seed);
    const auto result = test::identified(test::simulated(c).record, test::known(c));
    EXPECT_TRUE(result.trusted) << seed;
    ASSERT_TRUE(result.model);
    EXPECT_TRUE(result.model->drive.further().empty()) << seed;
    EXPECT_FALSE(result.model->drive.estimated[kDelay]) << seed;
  }
}

TEST(FurtherParameters, VelocityByDifferencesIsToldFromADelay) {
  auto c = servo(5);
  c.measurement.velocity = plant::VelocitySource::encoder;
  c.measurement.encoder_counts = 1e6;
  c.measurement.noise_rms = 0.0;
  const auto result = test::identified(test::simulated(c).record, test::known(c));
  EXPECT_TRUE(result.trusted);
  ASSERT_TRUE(result.model);
  EXPECT_EQ(result.model->drive.velocity, Velocity::differences);
  EXPECT_FALSE(result.model->drive.estimated[kDelay]);
  test::expect_within(result.model->drive.estimate(kDrivenInertia), 0.0015, 4.5, 0.01);
  test::expect_within(result.model->drive.estimate(kLoadInertia), 0.0021, 4.5, 0.01);
}

}  // namespace
}  // namespace resonid::fit
