// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/response/local_polynomial.hpp>

#include "drive_fixture.hpp"

namespace resonid {
namespace {

response::ResponseOptions with_delay() {
  response::ResponseOptions options;
  options.delay_s = 0.004;
  return options;
}

TEST(LocalPolynomial, MeetsTheAccuracyOfTheOracleOnAChirp) {
  // Independent implementation (tests/golden/README.md), +-35 bins, joint: noise-free rms 0.0124, noisy
  // 0.0479 (other seeds; own treatment of the ends).
  const test::BeltDrive drive;
  const auto excitation = test::chirp(35.0, 1.5, 17.0, drive.step_s);
  response::LocalPolynomialConfig config;
  config.frequencies_hz = test::range_hz(2.0, 33.0, 1.0);
  const auto truth = [&](double f) { return drive.response(f); };
  double fixed = 0.0;
  double chosen[2] = {0.0, 0.0};
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    config.half_width_bins = 35;
    auto response = response::local_polynomial(drive.run(excitation, 0.1, seed), config, with_delay());
    ASSERT_TRUE(response);
    fixed += test::relative_rms(response->frequency_hz, response->value, truth) / 6.0;
    config.half_width_bins = 0;
    for (int i = 0; i < 2; ++i) {
      response = response::local_polynomial(drive.run(excitation, 0.1, seed, 10.0 * i), config, with_delay());
      ASSERT_TRUE(response);
      chosen[i] += test::relative_rms(response->frequency_hz, response->value, truth) / 6.0;
    }
  }
  EXPECT_LT(fixed, 0.055);
  EXPECT_LT(chosen[0], 0.075);
  EXPECT_NEAR(chosen[1], chosen[0], 1e-6);
}

TEST(LocalPolynomial, IsFreeOfTransientsWhereWelchIsNot) {
  // Random torque from rest, sharp mode: a whole-record transform leaks, the local polynomial takes it out.
  const test::BeltDrive drive;
  std::mt19937_64 engine(4);
  std::normal_distribution<double> normal;
  std::vector<double> torque(20001);  // 20001 = 3 x 59 x 113: a length that has to be trimmed
  for (double& x : torque) x = normal(engine);
  response::LocalPolynomialConfig config;
  config.half_width_bins = 12;
  config.frequencies_hz = test::range_hz(5.05, 40.0, 1.0);  // between the bins
  const auto response = response::local_polynomial(drive.run(torque, 0.0, 1), config, with_delay());
  ASSERT_TRUE(response);
  ASSERT_EQ(response->lines(), config.frequencies_hz.size());
  EXPECT_LT(test::relative_rms(response->frequency_hz, response->value,
                               [&](double f) { return drive.response(f); }),
            3e-4);
}

TEST(LocalPolynomial, RegionsHoldTheTruthAsOftenAsTheySay) {
  const test::BeltDrive drive;
  response::LocalPolynomialConfig config;
  config.half_width_bins = 10;
  config.frequencies_hz = test::range_hz(4.0, 60.0, 1.0);
  int inside = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    std::mt19937_64 engine(50 + seed);
    std::normal_distribution<double> normal;
    std::vector<double> torque(10000);
    for (double& x : torque) x = 2.0 * normal(engine);
    const auto response = response::local_polynomial(drive.run(torque, 0.1, seed), config, with_delay());
    ASSERT_TRUE(response);
    for (std::size_t i = 0; i < response->lines(); ++i, ++all)
      inside += std::abs(response->value[i] - drive.response(response->frequency_hz[i])) <
                data::confidence_radius(response->std[i], 0.95);
  }
  EXPECT_NEAR(static_cast<double>(inside) / all, 0.95, 0.025);
}

TEST(LocalPolynomial, RefusesBadConfigurations) {
  const test::BeltDrive drive;
  const auto record = drive.run(test::chirp(35.0, 1.5, 2.0, drive.step_s), 0.1, 1);
  response::LocalPolynomialConfig config;
  config.degree = 7;
  EXPECT_EQ(response::local_polynomial_lines(record, config, Approach::joint).error().field, "degree");
  config.degree = 2;
  config.half_width_bins = 2;
  EXPECT_EQ(response::local_polynomial_lines(record, config, Approach::joint).error().field,
            "half_width_bins");
  config.half_width_bins = 10;
  config.frequencies_hz = {250.0};
  EXPECT_EQ(response::local_polynomial_lines(record, config, Approach::joint).error().field,
            "frequencies_hz");
}

}  // namespace
}  // namespace resonid
