// SPDX-License-Identifier: MIT
// Three masses: model against the simulator, which is made otherwise, and fits against its truth.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <experiments.hpp>
#include <random>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>

namespace resonid::fit {
namespace {

constexpr double kSquare = 0.05 * 0.05;  // of the rollers' radius

plant::ExperimentConfig chain(double noise, std::uint64_t seed = 1) {
  auto c = test::published_drive(noise, 10.0, seed);
  c.drive.structure = plant::Structure::three_mass;
  c.drive.middle_inertia = 0.012;
  c.drive.stiffness_2 = 9e4;
  c.drive.damping_2 = 60.0;
  c.excitation.kind = online::Kind::prbs;
  c.excitation.amplitude = 2.1;
  c.excitation.register_length = 11;
  c.run.duration_s = 12.0;
  return c;
}

DriveModel true_model(const plant::ExperimentConfig& c) {
  DriveModel m;
  m.structure = Structure::three_mass;
  m.sample_time_s = 1.0 / c.run.sample_rate_hz;
  const auto& d = c.drive;
  m.parameters = {{d.driven_inertia, d.load_inertia, kSquare * d.stiffness, kSquare * d.damping, 0.0},
                  d.middle_inertia,
                  kSquare * d.stiffness_2,
                  kSquare * d.damping_2};
  return m;
}

TEST(ThreeMass, ModelIsTheSimulators) {
  const auto c = chain(0.0);
  const auto truth = test::simulated(c).truth;
  const auto model = true_model(c);
  const auto modes = model.modes();
  ASSERT_EQ(modes.size(), 4U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_TRUE(modes[2 * i].anti);
    EXPECT_FALSE(modes[2 * i + 1].anti);
    EXPECT_NEAR(modes[2 * i].frequency_hz.value, truth.antiresonances[i].frequency_hz, 1e-9);
    EXPECT_NEAR(modes[2 * i + 1].frequency_hz.value, truth.resonances[i].frequency_hz, 1e-9);
  }
  EXPECT_EQ(model.resonance().value, modes[1].frequency_hz.value);
  EXPECT_EQ(model.antiresonance().value, modes[0].frequency_hz.value);
  const auto g = model.transfer_function();
  EXPECT_EQ(g.denominator.size(), 6U);
  for (const double f : {1.0, 8.0, 15.0, 23.0, 40.0, 170.0}) {
    const auto expected = truth.plant.response(f);
    EXPECT_LT(std::abs(model.response(f) - expected), 1e-9 * std::abs(expected)) << f;
    EXPECT_LT(std::abs(g.response(f) - expected), 1e-9 * std::abs(expected)) << f;
  }
}

TEST(ThreeMass, PolesAndZerosAreThoseOfTheResponse) {
  auto model = true_model(chain(0.0));
  model.parameters.viscous_friction = 0.05;
  const auto poles = model.poles(), zeros = model.zeros();
  ASSERT_EQ(poles.size(), 5U);
  ASSERT_EQ(zeros.size(), 4U);
  // The continuous response from them, against the hold at a frequency where the hold does nothing.
  model.sample_time_s = 1e-5;
  for (const double f : {1.0, 12.0, 30.0}) {
    const std::complex<double> s(0.0, 2.0 * 3.14159265358979 * f);
    std::complex<double> g = 1.0 / model.parameters.driven_inertia;
    for (const auto& z : zeros) g *= s - z.value;
    for (const auto& p : poles) g /= s - p.value;
    g *= std::exp(-0.5 * s * model.sample_time_s);
    EXPECT_LT(std::abs(model.response(f) - g), 1e-5 * std::abs(g)) << f;
  }
}

TEST(ThreeMass, RootsOfTwoMassesAndTheirErrorsFollowTheParameters) {
  DriveModel m;
  m.sample_time_s = 0.001;
  m.parameters = {0.03, 0.02, 150.0, 0.3, 0.0};
  m.estimated = estimated_parameters(Structure::two_mass, false, false);
  m.covariance(kStiffness, kStiffness) = 4.0;
  const auto zeros = m.zeros();
  ASSERT_EQ(zeros.size(), 2U);
  // s^2 J2 + s D + K = 0: ds/dK = -1/(2 J2 s + D).
  const std::complex<double> slope = -1.0 / (2.0 * 0.02 * zeros[0].value + 0.3);
  EXPECT_NEAR(zeros[0].value.real(), -0.3 / 0.04, 1e-9);
  EXPECT_NEAR(std::norm(zeros[0].value), 150.0 / 0.02, 1e-6);
  EXPECT_GT(zeros[0].value.imag(), 0.0);
  EXPECT_NEAR(zeros[0].covariance(0, 0), 4.0 * slope.real() * slope.real(), 1e-6);
  EXPECT_NEAR(zeros[0].covariance(1, 1), 4.0 * slope.imag() * slope.imag(), 1e-6);
  EXPECT_NEAR(zeros[0].covariance(0, 1), 4.0 * slope.real() * slope.imag(), 1e-6);
}

TEST(ThreeMass, ModesAndMassesBelongTogether) {
  const auto m = true_model(chain(0.0));
  const auto modes = m.modes();
  const double total = m.parameters.driven_inertia + m.parameters.middle_inertia + m.parameters.load_inertia;
  const auto found =
      data::three_mass_of_modes(total, {modes[0].frequency_hz.value, modes[2].frequency_hz.value},
                                {modes[1].frequency_hz.value, modes[3].frequency_hz.value});
  EXPECT_NEAR(found.driven_inertia / m.parameters.driven_inertia, 1.0, 1e-9);
  EXPECT_NEAR(found.middle_inertia / m.parameters.middle_inertia, 1.0, 1e-9);
  EXPECT_NEAR(found.load_inertia / m.parameters.load_inertia, 1.0, 1e-9);
  EXPECT_NEAR(found.stiffness / m.parameters.stiffness, 1.0, 1e-9);
  EXPECT_NEAR(found.stiffness_2 / m.parameters.stiffness_2, 1.0, 1e-9);
}

data::FrequencyResponse measured(const plant::Simulation& s, double relative_error, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  data::FrequencyResponse g;
  for (double f = 1.0; f <= 80.0; f += 0.5) {
    const auto value = s.truth.plant.response(f);
    const double sd = relative_error * std::abs(value);
    g.frequency_hz.push_back(f);
    const double re = normal(random), im = normal(random);
    g.value.push_back(value + sd / std::sqrt(2.0) * std::complex<double>(re, im));
    g.std.push_back(sd);
  }
  return g;
}

TEST(ThreeMass, IsFoundFromAResponseWithoutAStart) {
  const auto c = chain(0.0);
  const auto truth = true_model(c);
  ResponseFitConfig config;
  config.structure = Structure::three_mass;
  config.sample_time_s = truth.sample_time_s;
  const auto simulation = test::simulated(c);
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const auto fit = fit_response(measured(simulation, 0.02, seed), config);
    ASSERT_TRUE(fit.has_value());
    EXPECT_TRUE(fit->converged) << seed;
    EXPECT_LT(fit->misfit, 1.3) << seed;
    for (int i = 0; i < kParameterCount; ++i)
      if (has_parameter(Structure::three_mass, i))
        test::expect_within(fit->model.estimate(static_cast<Parameter>(i)),
                            truth.value(static_cast<Parameter>(i)), 4.0, 0.2);
  }
}

TEST(ThreeMass, IsFoundFromARecord) {
  const auto c = chain(0.05);
  const auto simulation = test::simulated(c);
  const auto truth = true_model(c);
  OutputErrorConfig config;
  config.initial = truth;
  config.initial.parameters = {{0.036, 0.029, 160.0, 0.4, 0.0}, 0.010, 200.0, 0.2};
  config.known_delay_s = c.measurement.delay_s;
  const auto fit = fit_output_error(simulation.record, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_TRUE(fit->converged);
  for (int i = 0; i < kParameterCount; ++i)
    if (has_parameter(Structure::three_mass, i))
      test::expect_within(fit->model.estimate(static_cast<Parameter>(i)),
                          truth.value(static_cast<Parameter>(i)), 4.0, 0.15);
  const auto modes = fit->model.modes();
  for (std::size_t i = 0; i < 2; ++i)
    test::expect_within(modes[2 * i + 1].frequency_hz, simulation.truth.resonances[i].frequency_hz, 4.0,
                        0.01);
}

}  // namespace
}  // namespace resonid::fit
