// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/response/welch.hpp>

#include "drive_fixture.hpp"

namespace resonid {
namespace {

data::Record golden_prbs() {
  data::Record record;
  record.sample_rate_hz = 500.0;
  record.excitation.samples = test::golden_column("f_prbs_sys2.csv", "ru");
  record.input.samples = test::golden_column("f_prbs_sys2.csv", "u_noisy");
  record.output.samples = test::golden_column("f_prbs_sys2.csv", "y_noisy");
  return record;
}

std::vector<double> random_torque(std::size_t samples, std::uint64_t seed) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<double> normal;
  std::vector<double> values(samples);
  for (double& x : values) x = 2.0 * normal(engine);
  return values;
}

TEST(Welch, AgreesWithTheGoldenResponses) {
  const auto golden = test::golden_json("f_expected.json");
  const auto f = golden.at("f").get<std::vector<double>>();
  const auto coherence = golden.at("coherence_ru_y").get<std::vector<double>>();
  response::WelchConfig config;
  config.segment_samples = 1024;
  config.band_low_hz = 2.0;
  config.band_high_hz = 40.0;
  response::ResponseOptions options;
  options.delay_s = 0.004;
  options.controller = data::pi_controller(golden.at("Kp"), golden.at("Ti"), 0.002);
  const std::pair<Approach, const char*> cases[] = {
      {Approach::direct, "direct"}, {Approach::indirect, "indirect"}, {Approach::joint, "joint"}};
  for (const auto& [approach, name] : cases) {
    options.approach = approach;
    const auto response = response::welch(golden_prbs(), config, options);
    ASSERT_TRUE(response) << response.error().requirement;
    const auto expected = test::golden_complex(golden.at(name));
    ASSERT_EQ(response->lines(), f.size());
    for (std::size_t i = 0; i < f.size(); ++i) {
      EXPECT_NEAR(response->frequency_hz[i], f[i], 1e-9);
      EXPECT_LT(std::abs(response->value[i] - expected[i]), 1e-6 * std::abs(expected[i]))
          << name << ' ' << f[i];
      if (approach != Approach::direct) {
        EXPECT_NEAR(response->coherence[i], coherence[i], 1e-6);
      }
    }
  }
}

TEST(Welch, HalfOverlappingHannSegmentsAreWorthTheTextbookNumber) {
  std::vector<double> window;
  for (int n = 0; n < 512; ++n) window.push_back(0.5 - 0.5 * std::cos(kTwoPi * n / 512.0));
  EXPECT_NEAR(response::equivalent_averages(window, 256, 1000) / 1000.0, 36.0 / 38.0, 1e-4);  // 1/(1 + 2/36)
  EXPECT_NEAR(response::equivalent_averages(window, 512, 10), 10.0, 1e-12);
}

TEST(Welch, RegionsHoldTheTruthAsOftenAsTheySay) {
  const test::BeltDrive drive;
  for (const std::size_t samples : {2600u, 12000u}) {  // about 4 and 22 segments
    response::WelchConfig config;
    config.segment_samples = 1024;
    config.band_low_hz = 25.0;  // smooth there, so leakage is small beside the noise
    config.band_high_hz = 60.0;
    response::ResponseOptions options;
    options.delay_s = 0.004;
    int inside = 0;
    int all = 0;
    for (std::uint64_t seed = 1; seed <= 12; ++seed) {
      const auto record = drive.run(random_torque(samples, 100 + seed), 0.3, seed);
      const auto response = response::welch(record, config, options);
      ASSERT_TRUE(response);
      for (std::size_t i = 0; i < response->lines(); ++i, ++all)
        inside += std::abs(response->value[i] - drive.response(response->frequency_hz[i])) <
                  data::confidence_radius(response->std[i], 0.95);
    }
    EXPECT_NEAR(static_cast<double>(inside) / all, 0.95, 0.025) << samples;
  }
}

TEST(Welch, FindsTheLoopWithoutKnowingTheController) {
  const test::BeltDrive drive;
  response::WelchConfig config;
  config.segment_samples = 4096;
  config.band_low_hz = 3.0;
  config.band_high_hz = 40.0;
  const auto lines =
      response::welch_lines(drive.run(random_torque(60000, 3), 0.0, 1), config, Approach::joint);
  ASSERT_TRUE(lines);
  const auto loop = response::loop_response(*lines);
  const auto controller = response::controller_response(*lines);
  ASSERT_TRUE(loop && controller);
  const auto truth = drive.controller();
  for (std::size_t i = 0; i < loop->lines(); ++i) {
    const double f = loop->frequency_hz[i];
    const auto c = truth.response(f);
    EXPECT_LT(std::abs(controller->value[i] / c - 1.0), 4e-3) << f;  // leakage only
    EXPECT_LT(std::abs(loop->value[i] - c * drive.response(f) * std::polar(1.0, -kTwoPi * f * 0.004)), 0.05)
        << f;
  }
}

TEST(Welch, RefusesWhatItCannotDo) {
  auto record = golden_prbs();
  response::WelchConfig config;
  config.segment_samples = 4096;
  EXPECT_EQ(response::welch_lines(record, config, Approach::joint).error().field, "segment_samples");
  config.segment_samples = 1024;
  config.band_high_hz = 251.0;
  EXPECT_EQ(response::welch_lines(record, config, Approach::joint).error().field, "band_high_hz");
  config.band_high_hz = 0.0;
  config.overlap = 1.0;
  EXPECT_EQ(response::welch_lines(record, config, Approach::joint).error().field, "overlap");
  config.overlap = 0.5;
  record.excitation.samples.clear();
  EXPECT_EQ(response::welch_lines(record, config, Approach::joint).error().field, "excitation");
  EXPECT_TRUE(response::welch_lines(record, config, Approach::direct));
  response::ResponseOptions options;
  options.approach = Approach::indirect;
  EXPECT_EQ(response::welch(golden_prbs(), config, options).error().field, "controller");
}

}  // namespace
}  // namespace resonid
