// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <resonid/response/detail/swept_response.hpp>

#include "drive_fixture.hpp"

namespace resonid {
namespace {

constexpr online::SweepLaw kChirp{35.0, 1.5, 17.0, online::Sweep::linear};

data::Record golden_chirp(const std::string& kind) {
  data::Record record;
  record.sample_rate_hz = 500.0;
  record.excitation.samples = test::golden_column("b_chirp_sys2.csv", "ru");
  record.input.samples = test::golden_column("b_chirp_sys2.csv", "u_" + kind);
  record.output.samples = test::golden_column("b_chirp_sys2.csv", "y_" + kind);
  return record;
}

/// The golden values were taken at the sample nearest to each whole hertz: its own frequency.
std::vector<double> nearest_sample_hz(const std::vector<double>& f_hz) {
  std::vector<double> nearest;
  for (const double f : f_hz)
    nearest.push_back(kChirp.frequency_hz(std::round(500.0 * 17.0 * (35.0 - f) / 33.5) / 500.0));
  return nearest;
}

TEST(SweptResponse, LocalCubicAgreesWithTheGoldenResponses) {
  const auto golden = test::golden_json("b_expected.json");
  response::SweptConfig config;
  config.chirp = kChirp;
  config.fit_offset = false;
  config.frequencies_hz = nearest_sample_hz(golden.at("f").get<std::vector<double>>());
  response::ResponseOptions options;
  options.delay_s = 0.004;
  const struct {
    const char* name;
    std::size_t half_width;
    bool correct;
  } cases[] = {{"local_cubic_500_ratio", 500, false},
               {"local_cubic_500_corrected", 500, true},
               {"local_cubic_700_corrected", 700, true}};
  for (const auto& c : cases)
    for (const char* kind : {"clean", "noisy"}) {
      config.half_width_samples = c.half_width;
      config.correct_sweep = c.correct;
      const auto response = response::swept_response(golden_chirp(kind), config, options);
      ASSERT_TRUE(response) << response.error().requirement;
      const auto expected = test::golden_complex(golden.at(c.name).at(kind));
      ASSERT_EQ(response->lines(), expected.size());
      for (std::size_t i = 0; i < expected.size(); ++i) {
        // Ascending here, the golden frequencies too.
        EXPECT_LT(std::abs(response->value[i] - expected[i]), 1e-6 * std::abs(expected[i]))
            << c.name << ' ' << kind << ' ' << response->frequency_hz[i];
      }
    }
}

TEST(SweptResponse, TrackersAgreeWithTheGoldenResponses) {
  const auto golden = test::golden_json("b_expected.json");
  response::SweptConfig config;
  config.chirp = kChirp;
  config.offset_state = false;
  config.frequencies_hz = golden.at("f").get<std::vector<double>>();
  response::ResponseOptions options;
  options.delay_s = 0.004;
  options.controller = data::pi_controller(golden.at("Kp"), golden.at("Ti"), 0.002);
  const struct {
    const char* name;
    response::SweptMethod method;
    double pole_radius;
    Approach approach;
  } cases[] = {{"lam8_direct", response::SweptMethod::tracker, 0.0, Approach::direct},
               {"lam8_indirect", response::SweptMethod::tracker, 0.0, Approach::indirect},
               {"forward_backward98", response::SweptMethod::forward_backward, 0.98, Approach::direct}};
  for (const auto& c : cases)
    for (const char* kind : {"clean", "noisy"}) {
      config.method = c.method;
      config.pole_radius = c.pole_radius;
      options.approach = c.approach;
      const auto response = response::swept_response(golden_chirp(kind), config, options);
      ASSERT_TRUE(response) << response.error().requirement;
      const auto expected = test::golden_complex(golden.at(c.name).at(kind));
      for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_LT(std::abs(response->value[i] - expected[i]), 1e-6 * std::abs(expected[i]))
            << c.name << ' ' << kind << ' ' << response->frequency_hz[i];
    }
}

TEST(SweptResponse, TrackerReproducesThePublishedFigures) {
  // Independent implementation (tests/golden/README.md), f0 + m t, lambda 8, direct, on a 0.1 Hz grid: 1.58
  // dB, 9.15 deg, rms 0.0618 without noise, 0.189 with.
  const test::BeltDrive drive;
  const auto excitation = test::chirp(35.0, 1.5, 17.0, drive.step_s);
  response::SweptConfig config;
  config.chirp = kChirp;
  config.method = response::SweptMethod::tracker;
  config.offset_state = false;
  config.frequencies_hz = test::range_hz(2.0, 33.0, 0.1);
  response::ResponseOptions options;
  options.approach = Approach::direct;
  options.delay_s = 0.004;
  const auto truth = [&](double f) { return drive.response(f); };
  const auto clean = response::swept_response(drive.run(excitation, 0.0, 1), config, options);
  ASSERT_TRUE(clean);
  double decibel = 0.0;
  double degree = 0.0;
  for (std::size_t i = 0; i < clean->lines(); ++i) {
    const auto error = clean->value[i] / truth(clean->frequency_hz[i]);
    decibel = std::max(decibel, std::abs(20.0 * std::log10(std::abs(error))));
    degree = std::max(degree, std::abs(std::arg(error)) * 180.0 / kPi);
  }
  EXPECT_NEAR(decibel, 1.58, 0.005);
  EXPECT_NEAR(degree, 9.15, 0.005);
  EXPECT_NEAR(test::relative_rms(clean->frequency_hz, clean->value, truth), 0.0618, 5e-5);
  double noisy = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto response = response::swept_response(drive.run(excitation, 0.1, seed), config, options);
    ASSERT_TRUE(response);
    noisy += test::relative_rms(response->frequency_hz, response->value, truth) / 20.0;
  }
  EXPECT_NEAR(noisy, 0.189, 0.01);
}

TEST(SweptResponse, LocalCubicMeetsItsAccuracyAtAnyOperatingPoint) {
  const test::BeltDrive drive;
  const auto excitation = test::chirp(35.0, 1.5, 17.0, drive.step_s);
  response::SweptConfig config;
  config.chirp = kChirp;
  config.frequencies_hz = test::range_hz(2.0, 33.0, 1.0);
  response::ResponseOptions options;
  options.delay_s = 0.004;
  double rms[2] = {0.0, 0.0};
  int inside = 0;
  int all = 0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed)
    for (int i = 0; i < 2; ++i) {
      const auto record = drive.run(excitation, 0.1, seed, 10.0 * i);
      const auto response = response::swept_response(record, config, options);
      ASSERT_TRUE(response);
      rms[i] += test::relative_rms(response->frequency_hz, response->value,
                                   [&](double f) { return drive.response(f); }) /
                6.0;
      for (std::size_t line = 0; line < response->lines(); ++line, ++all)
        inside += std::abs(response->value[line] - drive.response(response->frequency_hz[line])) <
                  data::confidence_radius(response->std[line], 0.95);
    }
  EXPECT_LT(rms[0], 0.055);  // 0.045 over 20 seeds; the oracle's best without the plant's structure is 0.046
  EXPECT_NEAR(rms[1], rms[0], 1e-6);
  EXPECT_NEAR(static_cast<double>(inside) / all, 0.95, 0.04);
}

TEST(SweptResponse, ApproachesAgreeWithoutNoise) {
  const test::BeltDrive drive;
  const auto record = drive.run(test::chirp(1.5, 35.0, 34.0, drive.step_s), 0.0, 1);
  response::SweptConfig config;
  config.chirp = {1.5, 35.0, 34.0, online::Sweep::linear};
  config.frequencies_hz = test::range_hz(5.0, 33.0, 1.0);
  response::ResponseOptions options;
  options.delay_s = 0.004;
  options.controller = drive.controller();
  for (const auto approach : {Approach::direct, Approach::indirect, Approach::joint}) {
    options.approach = approach;
    const auto response = response::swept_response(record, config, options);
    ASSERT_TRUE(response);
    EXPECT_LT(test::relative_rms(response->frequency_hz, response->value,
                                 [&](double f) { return drive.response(f); }),
              0.007);
  }
}

TEST(SweptResponse, ReportsEveryTenthOfAHertzUnlessToldOtherwise) {
  response::SweptConfig config;
  config.chirp = kChirp;
  const auto lines = response::swept_lines(golden_chirp("noisy"), config, Approach::joint);
  ASSERT_TRUE(lines);
  ASSERT_EQ(lines->lines.size(), 336u);
  EXPECT_NEAR(lines->lines.front().frequency_hz, 1.5, 1e-9);
  EXPECT_NEAR(lines->lines[100].frequency_hz, 11.5, 1e-9);
  EXPECT_NEAR(lines->lines.back().frequency_hz, 35.0, 1e-9);
}

TEST(SweptResponse, RefusesSweepsThatTheRecordCannotHold) {
  const auto record = golden_chirp("noisy");
  response::SweptConfig config;
  config.chirp = kChirp;
  config.chirp.to_hz = 251.0;
  EXPECT_EQ(response::swept_lines(record, config, Approach::joint).error().field, "to_hz");
  config.chirp = kChirp;
  config.chirp.duration_s = 30.0;
  EXPECT_EQ(response::swept_lines(record, config, Approach::joint).error().field, "duration_s");
  config.chirp = kChirp;
  config.frequencies_hz = {36.0};
  EXPECT_EQ(response::swept_lines(record, config, Approach::joint).error().field, "frequencies_hz");
}

}  // namespace
}  // namespace resonid
