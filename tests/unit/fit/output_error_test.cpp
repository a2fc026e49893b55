// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <golden.hpp>
#include <numbers>
#include <random>
#include <resonid/fit/detail/order_selection.hpp>
#include <resonid/fit/output_error.hpp>

namespace resonid::fit {
namespace {

constexpr double kRadiusSquared = 0.05 * 0.05;

data::Record golden_record(const char* file, const char* input, const char* output) {
  data::Record record;
  record.sample_rate_hz = 500.0;
  record.input.samples = test::golden_column(file, input);
  record.output.samples = test::golden_column(file, output);
  return record;
}

DriveModel rough_start() {
  DriveModel start;
  start.parameters = {0.038, 0.027, 160.0, 0.4, 0.0};
  return start;
}

void expect_golden(const OutputErrorFit& fit, const std::vector<double>& golden) {
  const std::array<double, 4> unit = {1.0, 1.0, kRadiusSquared, kRadiusSquared};
  for (int i = 0; i < 4; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(fit.model.value(static_cast<Parameter>(i)) / (golden[k] * unit[k]), 1.0, 1e-5)
        << kParameterNames[k];
  }
}

OutputErrorConfig golden_config() {
  OutputErrorConfig config;
  config.initial = rough_start();
  config.known_delay_s = 0.004;
  config.initial_state = config.offset = config.noise_model = false;
  return config;
}

TEST(OutputError, MeetsTheGoldenMaximumLikelihoodFits) {
  const auto b = test::golden_json("b_expected.json").at("oe_ml");
  for (const char* kind : {"clean", "noisy"}) {
    const auto record = golden_record("b_chirp_sys2.csv", (std::string("u_") + kind).c_str(),
                                      (std::string("y_") + kind).c_str());
    const auto fit = fit_output_error(record, golden_config());
    ASSERT_TRUE(fit.has_value());
    EXPECT_TRUE(fit->converged);
    expect_golden(*fit, b.at(kind).get<std::vector<double>>());
  }
  const auto f = test::golden_json("f_expected.json").at("oe_ml").get<std::vector<double>>();
  const auto fit = fit_output_error(golden_record("f_prbs_sys2.csv", "u_noisy", "y_noisy"), golden_config());
  ASSERT_TRUE(fit.has_value());
  expect_golden(*fit, f);
}

TEST(OutputError, StandardDeviationsAreThoseOfTheGoldenBound) {
  const auto golden = test::golden_json("b_expected.json");
  const auto fit = fit_output_error(golden_record("b_chirp_sys2.csv", "u_noisy", "y_noisy"), golden_config());
  const auto bound = golden.at("crb_log_params_sd").get<std::vector<double>>();
  for (int i = 0; i < 4; ++i) {
    const auto e = fit->model.estimate(static_cast<Parameter>(i));
    EXPECT_NEAR(e.std / e.value / bound[static_cast<std::size_t>(i)], 1.0, 0.05);
  }
}

TEST(OutputError, OperatingPointLoadTorqueAndMovingStartDoNoHarm) {
  auto record = golden_record("b_chirp_sys2.csv", "u_noisy", "y_noisy");
  for (auto& y : record.output.samples) y += 10.0;
  for (auto& u : record.input.samples) u += 0.7;  // carried by a load torque that nobody measures
  OutputErrorConfig config;
  config.initial = rough_start();
  config.known_delay_s = 0.004;
  const auto fit = fit_output_error(record, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_EQ(fit->noise.order(), 0U);
  EXPECT_NEAR(fit->offset->value, -0.7, 5.0 * fit->offset->std);
  const auto golden = test::golden_json("b_expected.json").at("oe_ml").at("noisy").get<std::vector<double>>();
  EXPECT_NEAR(fit->model.parameters.driven_inertia / golden[0], 1.0, 0.005);
  EXPECT_NEAR(fit->model.parameters.stiffness / (golden[2] * kRadiusSquared), 1.0, 0.005);
  EXPECT_GT(fit->fit_percent, 60.0);
}

/// Analytic truth: a rigid machine under a sampled sine of torque, with dry friction in one direction of
/// travel.
data::Record rigid_record(double coulomb, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0.0, 0.01);
  data::Record record;
  record.sample_rate_hz = 1000.0;
  double velocity = 0.0;
  const double inertia = 0.05, friction = 0.2, step = 0.001;
  const double decay = std::exp(-friction / inertia * step);
  for (int k = 0; k < 6000; ++k) {
    const double t = k * step;
    const double torque =
        3.0 * std::sin(2.0 * std::numbers::pi * 1.3 * t) + std::sin(2.0 * std::numbers::pi * 7.0 * t);
    record.input.samples.push_back(torque);
    record.output.samples.push_back(velocity + normal(random));
    const double net = torque - coulomb * (velocity > 0.0 ? 1.0 : -1.0);
    velocity = decay * velocity + (1.0 - decay) / friction * net;
  }
  return record;
}

TEST(OutputError, RigidMachineWithDryFriction) {
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.08;
  config.viscous_friction = config.coulomb_friction = true;
  const auto fit = fit_output_error(rigid_record(0.5, 1), config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->model.parameters.driven_inertia, 0.05, 2e-4);
  EXPECT_NEAR(fit->model.parameters.viscous_friction, 0.2, 0.01);
  EXPECT_NEAR(fit->coulomb_friction->value, 0.5, 0.02);
}

TEST(OutputError, FractionalDelayIsFound) {
  // Output of an integrator between samples: exact for a held input.
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal;
  data::Record record;
  record.sample_rate_hz = 1000.0;
  double velocity = 0.0, past = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double torque = normal(random);
    // Delay 1.25 samples: at t_k the machine of t_k - 1.25 ms is seen.
    record.output.samples.push_back(velocity - 0.25 * past / 0.05 * 0.001 + 1e-6 * normal(random));
    record.input.samples.push_back(torque);
    if (k > 0) velocity += record.input.samples[static_cast<std::size_t>(k - 1)] / 0.05 * 0.001;
    past = record.input.samples[static_cast<std::size_t>(std::max(0, k - 1))];
  }
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.08;
  config.delay = true;
  config.noise_model = false;
  const auto fit = fit_output_error(record, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->model.delay_s, 0.00125, 2e-6);
  EXPECT_NEAR(fit->model.parameters.driven_inertia, 0.05, 1e-5);
}

/// A delay that is known too long by half a sample is found, by five it presses against its bound.
TEST(OutputError, DelayThatPressesAgainstItsBoundIsNoFit) {
  const auto record = rigid_record(0.0, 3);
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.06;
  config.viscous_friction = config.delay = true;
  config.noise_model = false;  // one of sines takes up what they leave
  for (const auto& [known_s, converges] : {std::pair{0.0005, true}, std::pair{0.005, false}}) {
    config.known_delay_s = known_s;
    const auto fit = fit_output_error(record, config);
    ASSERT_TRUE(fit.has_value());
    EXPECT_EQ(fit->converged, converges);
    if (converges) {
      const auto delay = fit->model.estimate(kDelay);
      EXPECT_NEAR(delay.value, -0.0005, 4.0 * delay.std);
    } else {
      EXPECT_EQ(fit->model.delay_s, -0.001);
    }
  }
}

TEST(OutputError, DelayOfAShortRecordStaysWithinHalfOfIt) {
  auto record = rigid_record(0.0, 4);
  record.input.samples.resize(60);
  record.output.samples.resize(60);
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.05;
  config.known_delay_s = 12.0 * record.sample_time_s();
  config.delay = true;
  config.initial.delay_s = 49.0 * record.sample_time_s();
  EXPECT_EQ(fit_output_error(record, config).error().field, "initial");
  config.initial.delay_s = 17.0 * record.sample_time_s();
  const auto fit = fit_output_error(record, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_LE(fit->model.delay_s, 18.0 * record.sample_time_s() * (1.0 + 1e-9));
}

/// The noise of a fit begins the next one in fewer rounds, and ends at the same.
TEST(OutputError, GoesOnFromTheNoiseOfAnotherFit) {
  auto record = rigid_record(0.0, 2);
  double slow = 0.0;
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0.0, 0.02);
  for (auto& y : record.output.samples) y += slow = 0.95 * slow + normal(random);
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.08;
  config.viscous_friction = true;
  const auto first = fit_output_error(record, config);
  ASSERT_TRUE(first && first->converged);
  ASSERT_GT(first->noise.order(), 0U);
  config.noise_start = {first->noise};
  const auto again = fit_output_error(record, config);
  ASSERT_TRUE(again && again->converged);
  const auto expected = first->model.estimate(kDrivenInertia);
  EXPECT_NEAR(again->model.parameters.driven_inertia, expected.value, 0.05 * expected.std);
  config.noise_start.push_back(first->noise);
  EXPECT_EQ(fit_output_error(record, config).error().field, "noise_start");
}

/// Samples that were missing and are interpolated have no weight, whatever stands there.
TEST(OutputError, InterpolatedSamplesSayNothing) {
  auto record = rigid_record(0.0, 2);
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal(0.0, 0.02);
  for (auto& y : record.output.samples) y += normal(random);
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.08;
  config.viscous_friction = true;
  const auto complete = fit_output_error(record, config);
  ASSERT_TRUE(complete && complete->converged);
  const auto expected = complete->model.estimate(kDrivenInertia);
  auto damaged = record;
  for (std::size_t k = 37; k < damaged.samples(); k += 100) {
    damaged.output.samples[k] += 5.0;
    damaged.sampling.filled.push_back(k);
  }
  const auto fit = fit_output_error(damaged, config);
  ASSERT_TRUE(fit && fit->converged);
  EXPECT_NEAR(fit->model.parameters.driven_inertia, expected.value, expected.std);
  EXPECT_NEAR(fit->model.estimate(kDrivenInertia).std, expected.std, 0.2 * expected.std);
  config.holdout = holdout_parts(damaged.samples());
  const auto judged = fit_output_error(damaged, config);
  ASSERT_TRUE(judged && judged->holdout);
  EXPECT_LT(judged->holdout->samples, complete->samples / 3);
  damaged.sampling.filled.clear();
  const auto misled = fit_output_error(damaged, config);
  ASSERT_TRUE(misled && misled->holdout);
  EXPECT_LT(misled->holdout->fit_percent, judged->holdout->fit_percent - 1.0);
}

/// In the loop of a controller of the wrong sign the simulation overflows: that is no fit.
TEST(OutputError, SimulationThatOverflowsIsNoFit) {
  auto record = rigid_record(0.0, 2);
  record.excitation.samples = record.input.samples;
  OutputErrorConfig config;
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.08;
  config.predictor = Predictor::closed_loop;
  for (const double gain : {-20.0, -500.0}) {
    config.controller = data::TransferFunction{{gain}, {1.0}, record.sample_time_s()};
    const auto fit = fit_output_error(record, config);
    EXPECT_FALSE(fit && fit->converged && fit->fit_percent > 50.0) << gain << ": " << fit->fit_percent;
    EXPECT_FALSE(fit && fit->converged && std::isnan(fit->fit_percent)) << gain;
  }
}

TEST(OutputError, RefusesWhatItCannotUse) {
  data::Record record = rigid_record(0.0, 1);
  OutputErrorConfig config;
  EXPECT_EQ(fit_output_error(record, config).error().field, "initial");
  config.initial.structure = Structure::rigid;
  config.initial.parameters.driven_inertia = 0.05;
  config.known_delay_s = -1.0;
  EXPECT_EQ(fit_output_error(record, config).error().field, "known_delay_s");
  config.known_delay_s = 3.0;
  EXPECT_EQ(fit_output_error(record, config).error().field, "known_delay_s");
  record.output.samples.resize(10);
  EXPECT_EQ(fit_output_error(record, config).error().field, "record");
}

}  // namespace
}  // namespace resonid::fit
