// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <recordings.hpp>
#include <resonid/response/detail/tracked_lines.hpp>
#include <resonid/response/periodic_averaging.hpp>

#include "bench_fixture.hpp"
#include "drive_fixture.hpp"

namespace resonid {
namespace {

data::Record golden_multisine(const std::string& system, const std::string& kind) {
  const std::string file = "c_multisine_" + system + ".csv";
  data::Record record;
  record.sample_rate_hz = 500.0;
  record.excitation.samples = test::golden_column(file, "ru");
  record.input.samples = test::golden_column(file, "u_" + kind);
  record.output.samples = test::golden_column(file, "y_" + kind);
  return record;
}

response::ResponseOptions with_delay() {
  response::ResponseOptions options;
  options.delay_s = 0.004;
  return options;
}

TEST(TrackedLines, LeastSquaresAgreesWithTheGoldenLines) {
  const auto golden = test::golden_json("c_expected.json");
  response::TrackedLinesConfig config;
  config.method = response::LineMethod::least_squares;
  config.lines_hz = golden.at("lines_hz").get<std::vector<double>>();
  config.first_sample = 2500;
  for (const char* system : {"A", "B"})
    for (const char* kind : {"clean", "noisy"}) {
      const auto response = response::tracked_lines(golden_multisine(system, kind), config, with_delay());
      ASSERT_TRUE(response) << response.error().requirement;
      const auto expected = test::golden_complex(
          golden.at(std::string("system_") + system).at("least_squares_2500_7499").at(kind));
      for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_LT(std::abs(response->value[i] - expected[i]), 1e-6 * std::abs(expected[i]))
            << system << kind << i;
    }
}

TEST(TrackedLines, SettledLinesAreExactWithoutNoise) {
  // The 8 lines of Publication IV; the golden record has 9 digits and 15 s, hence not better than 1e-7.
  const auto golden = test::golden_json("c_expected.json");
  response::TrackedLinesConfig config;
  config.lines_hz = golden.at("lines_hz").get<std::vector<double>>();
  for (const char* system : {"A", "B"}) {
    const auto truth = test::golden_complex(golden.at(std::string("system_") + system).at("G_true"));
    for (const std::size_t period : {0u, 5000u}) {
      config.period_samples = period;
      const auto response = response::tracked_lines(golden_multisine(system, "clean"), config, with_delay());
      ASSERT_TRUE(response);
      ASSERT_EQ(response->lines(), 8u);
      for (std::size_t i = 0; i < 8; ++i)
        EXPECT_LT(std::abs(response->value[i] / truth[i] - 1.0), 2e-6)
            << system << ' ' << response->frequency_hz[i];
    }
  }
}

TEST(TrackedLines, RegionsHoldTheTruthAsOftenAsTheySay) {
  const test::BeltDrive drive;
  const std::vector<int> bins{29, 59, 89, 119, 149, 179, 209, 239};
  const auto excitation = test::multisine(5000, 3, bins);  // 30 s, lines at bins/10 Hz
  response::TrackedLinesConfig config;
  for (const int bin : bins) config.lines_hz.push_back(0.1 * bin);
  const struct {
    response::LineMethod method;
    std::size_t period;
  } cases[] = {{response::LineMethod::kalman, 0},
               {response::LineMethod::kalman, 5000},
               {response::LineMethod::sliding_dft, 5000},
               {response::LineMethod::least_squares, 0}};
  for (const auto& c : cases) {
    config.method = c.method;
    config.period_samples = c.period;
    config.first_sample = c.method == response::LineMethod::kalman ? 0 : 2000;
    int inside = 0;
    int all = 0;
    for (std::uint64_t seed = 1; seed <= 25; ++seed) {
      const auto response =
          response::tracked_lines(drive.run(excitation, 0.1, seed, 10.0), config, with_delay());
      ASSERT_TRUE(response);
      ASSERT_EQ(response->lines(), 8u);
      for (std::size_t i = 0; i < 8; ++i, ++all)
        inside += std::abs(response->value[i] - drive.response(response->frequency_hz[i])) <
                  data::confidence_radius(response->std[i], 0.95);
    }
    EXPECT_NEAR(static_cast<double>(inside) / all, 0.95, 0.04)
        << "method " << static_cast<int>(c.method) << " period " << c.period;
  }
}

TEST(TrackedLines, SaysWhichLinesHaveNotSettled) {
  const test::BeltDrive drive;
  const auto record = drive.run(test::multisine(5000, 1, {29, 149}), 0.01, 1);
  response::TrackedLinesConfig config;
  config.lines_hz = {2.9, 14.9};
  config.pole_radius = 0.99995;  // 20 000 samples of memory in a record of 5000
  const auto response = response::tracked_lines(record, config, with_delay());
  ASSERT_TRUE(response);
  EXPECT_EQ(response->lines(), 0u);
  EXPECT_EQ(response->unsettled_hz, config.lines_hz);
}

TEST(TrackedLines, RefusesBadConfigurations) {
  const test::BeltDrive drive;
  const auto record = drive.run(test::multisine(500, 4, {3, 12}), 0.01, 1);
  response::TrackedLinesConfig config;
  EXPECT_EQ(response::tracked_line_estimates(record, config, Approach::joint).error().field, "lines_hz");
  config.lines_hz = {3.0, 3.0};
  EXPECT_EQ(response::tracked_line_estimates(record, config, Approach::joint).error().field, "lines_hz");
  config.lines_hz = {3.0, 12.0};
  config.method = response::LineMethod::sliding_dft;
  EXPECT_EQ(response::tracked_line_estimates(record, config, Approach::joint).error().field,
            "window_samples");
  config.window_samples = 499;
  EXPECT_EQ(response::tracked_line_estimates(record, config, Approach::joint).error().field, "lines_hz");
}

/// How many lines of `response` differ from the same lines of `reference` by more than both 95 % regions
/// explain.
std::size_t apart(const data::FrequencyResponse& response, const data::FrequencyResponse& reference) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < response.lines(); ++i)
    for (std::size_t j = 0; j < reference.lines(); ++j)
      if (std::abs(response.frequency_hz[i] - reference.frequency_hz[j]) < 1e-6)
        count += std::abs(response.value[i] - reference.value[j]) >
                 data::confidence_radius(std::hypot(response.std[i], reference.std[j]), 0.95);
  return count;
}

TEST(TrackedLines, AgreeWithPeriodicAveragingOnTheTwoMassBench) {
  RESONID_RECORDING_OR_SKIP(path, "utokyo_two_mass_bench/multisine.csv");
  const auto record = test::two_mass_bench(path);
  response::PeriodicConfig periodic;
  periodic.drop_periods = 1;
  const auto reference = response::periodic_average(record, periodic, test::direct());
  ASSERT_TRUE(reference);
  response::TrackedLinesConfig config;
  config.first_sample = 2500;
  config.period_samples = 2500;
  config.method = response::LineMethod::sliding_dft;
  for (int f = 11; f <= 250; ++f) config.lines_hz.push_back(f);
  const auto sliding = response::tracked_lines(record, config, test::direct());
  ASSERT_TRUE(sliding);
  ASSERT_EQ(sliding->lines(), 240u);
  EXPECT_EQ(apart(*sliding, *reference), 0u);

  config.method = response::LineMethod::kalman;
  config.lines_hz.clear();
  for (int f = 11; f <= 241; f += 10) config.lines_hz.push_back(f);
  const auto kalman = response::tracked_lines(record, config, test::direct());
  ASSERT_TRUE(kalman);
  EXPECT_EQ(kalman->lines() + kalman->unsettled_hz.size(), 24u);
  EXPECT_GE(kalman->lines(), 20u);
  EXPECT_LE(apart(*kalman, *reference), 2u);
}

}  // namespace
}  // namespace resonid
