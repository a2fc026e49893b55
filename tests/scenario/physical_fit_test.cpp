// SPDX-License-Identifier: MIT
// A few seeds of what tests/statistics/physical_fit_test.cpp claims, and fits in a tight loop.
#include <gtest/gtest.h>

#include <record_fits.hpp>
#include <resonid/response/welch.hpp>
#include <tight_loop.hpp>

namespace resonid {
namespace {

using test::simulated;

TEST(PhysicalFit, IsNearTheBoundOverAFewSeeds) {
  const auto e = test::efficiency("vi_chirp_a", 0.0, 0.0, 1, 6);
  double mean = 0.0;
  for (int i = 0; i < test::kFigures; ++i) mean += e.ratio(i) * e.ratio(i) / test::kFigures;
  EXPECT_LE(std::sqrt(mean), 1.6);  // chi-square over 6 seeds: 0.1 % of luck
}

/// Four evenly spaced of the twenty windows of tests/statistics, ten seeds each. 40 normalised errors: an rms
/// outside 0.65 ... 1.38 is left by chance once in 1000 times, above 1.3 once in 250.
TEST(PhysicalFit, HalfASecondOfPrbsTellsTheResonance) {
  const test::WindowErrors e("vi_prbs_a", 0.5, 10.0, 10, [](int window) { return window % 5 == 0; });
  EXPECT_EQ(e.refused, 0);
  ASSERT_EQ(e.over_bar.size(), 40U);
  RecordProperty("over bound", std::to_string(e.rms(e.over_bound)));
  RecordProperty("over bar", std::to_string(e.rms(e.over_bar)));
  EXPECT_LE(e.rms(e.over_bound), 1.3);
  EXPECT_GT(e.rms(e.over_bar), 0.65);
  EXPECT_LT(e.rms(e.over_bar), 1.38);
  EXPECT_LE(e.beyond(), 1);
}

TEST(PhysicalFit, WithoutNoiseTheResponseIsExactAndWithItNearTheBound) {
  auto c = io::shipped_experiment("vi_chirp_a");
  std::vector<double> grid;
  for (double f = 2.0; f <= 33.0; f += 1.0) grid.push_back(f);
  const auto error = [&](double noise, std::uint64_t seed) {
    c.measurement.noise_rms = noise;
    c.run.seed = seed;
    const auto s = simulated(c, grid);
    const auto fit = test::fitted_from_scratch(s.record, c.measurement.delay_s);
    const auto found = fit->model.values(grid);
    double sum = 0.0;
    for (std::size_t i = 0; i < grid.size(); ++i)
      sum += std::norm(found[i] / s.truth.response.value[i] - 1.0) / static_cast<double>(grid.size());
    return std::sqrt(sum);
  };
  EXPECT_LT(error(0.0, 1), 1e-9);
  double mean = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) mean += error(0.1, seed) / 20.0;
  RecordProperty("response rms", std::to_string(mean));
  EXPECT_LE(mean, 0.0145);
}

/// Noise 1 rad/s and three times the gain, where direct spectral analysis tends to -1/C.
TEST(PhysicalFit, PredictorsAreFourTimesBetterThanDirectSpectraInATightLoop) {
  auto c = io::shipped_experiment("vi_prbs_a");
  c.measurement.noise_rms = 1.0;
  c.controller.gain *= 3.0;
  std::vector<double> grid;
  for (double f = 2.0; f <= 33.0; f += 1.0) grid.push_back(f);
  constexpr int kSeeds = 2;
  double direct = 0.0;
  std::array<double, 3> model{};
  for (int seed = 1; seed <= kSeeds; ++seed) {
    c.run.seed = static_cast<std::uint64_t>(seed);
    const auto s = simulated(c, grid);
    const auto rms = [&](auto&& value) {
      double sum = 0.0;
      for (std::size_t i = 0; i < grid.size(); ++i)
        sum += std::norm(value(i) / s.truth.response.value[i] - 1.0) / static_cast<double>(grid.size());
      return std::sqrt(sum) / kSeeds;
    };
    auto options = test::known(c);
    options.method = identification::Method::welch;
    options.approach = Approach::direct;
    options.model = identification::ModelChoice::none;
    const auto welch = test::identified(s.record, options);
    direct += rms([&](std::size_t i) { return welch.response.at(grid[i]); });
    for (const auto predictor :
         {fit::Predictor::open_loop, fit::Predictor::closed_loop, fit::Predictor::joint}) {
      fit::OutputErrorConfig config;
      config.initial.parameters = {0.038, 0.027, 160.0, 0.4, 0.0};
      config.known_delay_s = c.measurement.delay_s;
      config.predictor = predictor;
      if (predictor == fit::Predictor::closed_loop) config.controller = options.controller;
      const auto fit = fit::fit_output_error(s.record, config);
      ASSERT_TRUE(fit.has_value()) << fit.error().requirement;
      EXPECT_TRUE(fit->converged);
      const auto values = fit->model.values(grid);
      model[static_cast<std::size_t>(predictor)] += rms([&](std::size_t i) { return values[i]; });
    }
  }
  for (std::size_t i = 0; i < model.size(); ++i) {
    RecordProperty("predictor " + std::to_string(i), std::to_string(model[i]));
    EXPECT_LT(4.0 * model[i], direct) << i << ": " << model[i];
  }
}

/// The same loop with noise of 0.5 Nm on the recorded torque, a seventh of what the controller makes of the
/// output's noise: the joint fit takes the controller from the record and keeps its error bars.
TEST(PhysicalFit, JointFitHoldsWithNoiseOnTheInput) {
  const auto e = test::joint_in_tight_loop(0.5, 1, 4);
  RecordProperty("factor", std::to_string(e.direct / e.joint));
  RecordProperty("squared distance", std::to_string(e.distance));
  EXPECT_LT(4.0 * e.joint, e.direct);
  EXPECT_LT(e.distance, 9.8);  // mean of 4 of chi-square of 4 degrees: 0.1 % of luck
}

TEST(PhysicalFit, ClosedLoopPredictorIsExactWithoutNoise) {
  auto c = test::published_drive(0.0, 10.0);
  test::prbs(c);
  const auto s = simulated(c);
  fit::OutputErrorConfig config;
  config.initial.parameters = {0.038, 0.027, 160.0, 0.4, 0.0};
  config.known_delay_s = c.measurement.delay_s;
  config.predictor = fit::Predictor::closed_loop;
  config.controller = test::known(c).controller;
  config.noise_model = false;
  const auto fit = fit::fit_output_error(s.record, config);
  ASSERT_TRUE(fit.has_value());
  const auto truth = test::drive_parameters(c);
  for (int i = 0; i < 4; ++i)
    EXPECT_NEAR(fit->model.value(static_cast<fit::Parameter>(i)) / truth(i), 1.0, 1e-6);
}

}  // namespace
}  // namespace resonid
