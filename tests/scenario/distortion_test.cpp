// SPDX-License-Identifier: MIT
// Detection lines of an odd random multisine, and realisations of it: a dry drive shows distortion, a linear
// one none.
#include <experiments.hpp>
#include <resonid/base/constants.hpp>

namespace resonid {
namespace {

identification::Result measured(double coulomb_newton_m) {
  auto experiment = test::published_drive(0.001);
  experiment.excitation.kind = online::Kind::multisine;
  experiment.excitation.phases = online::Phases::random;
  experiment.excitation.amplitude = 0.3;
  std::vector<double> lines;
  for (int k = 3, i = 0; k < 80; k += 2, ++i)
    if (i % 4 != 2) lines.push_back(0.5 * k);
  EXPECT_TRUE(experiment.excitation.lines_hz.assign(lines));
  experiment.run.duration_s = 16.0;  // eight periods of 2 s
  experiment.friction.driven.coulomb = coulomb_newton_m;
  auto options = test::known(experiment);
  options.drop_periods = 2;
  options.method = identification::Method::periodic;
  options.period_samples = 1000;
  return test::identified(test::simulated(experiment).record, options);
}

TEST(NonLinearDistortion, IsFoundWithDryFrictionOnly) {
  EXPECT_EQ(test::finding(measured(0.0), "non-linear-distortion"), nullptr);
  const auto dry = measured(0.2);
  const auto* finding = test::finding(dry, "non-linear-distortion");
  ASSERT_NE(finding, nullptr);
  EXPECT_GT(finding->value.value_or(0.0), 0.01);
  EXPECT_NE(finding->meaning.find("odd"), std::string::npos);
}

constexpr std::size_t kPeriods = 5, kRealisations = 8, kPeriod = 1000;
constexpr double kNoise = 0.001;

/// 2 ... 39.5 Hz, odd multiples of 0.5 Hz less one of four; everything by auto.
plant::ExperimentConfig realisations(double coulomb_newton_m, std::uint64_t seed) {
  auto experiment = test::published_drive(kNoise, 0.0, seed);
  auto& e = experiment.excitation;
  e.kind = online::Kind::multisine;
  e.phases = online::Phases::random;
  e.amplitude = 0.3;
  e.seed = seed;
  e.periods_per_realisation = kPeriods;
  e.detection_lines = online::DetectionLines::odd_random;
  std::vector<double> lines;
  for (int k = 3; k < 80; ++k) lines.push_back(0.5 * k);
  EXPECT_TRUE(e.lines_hz.assign(lines));
  experiment.run.duration_s = 2.0 * static_cast<double>(kPeriods * kRealisations);
  experiment.friction.driven.coulomb = coulomb_newton_m;
  return experiment;
}

struct Approximation {
  identification::Result result;
  data::FrequencyResponse truth;  ///< Of the drive without friction.
};

Approximation approximated(double coulomb_newton_m, std::uint64_t seed) {
  const auto experiment = realisations(coulomb_newton_m, seed);
  auto options = test::known(experiment);
  options.model = identification::ModelChoice::none;
  auto result = test::identified(test::simulated(experiment).record, options);
  const auto truth = test::simulated(experiment, result.response.frequency_hz).truth.response;
  return {std::move(result), truth};
}

TEST(BestLinear, DryFrictionShowsByBothWays) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto [result, truth] = approximated(0.2, seed);
    EXPECT_EQ(result.method, "best-linear");
    ASSERT_TRUE(result.distortion);
    const auto& d = *result.distortion;
    EXPECT_EQ(d.realisations, kRealisations);
    EXPECT_TRUE(d.scatter.significant);
    EXPECT_TRUE(d.odd.significant);
    // Friction that is the same both ways is odd: what even lines show is a small part of it.
    EXPECT_LT(d.even.level, 0.3 * d.odd.level);
    // The levels of excited and of silent lines are of one size.
    EXPECT_GT(d.scatter.level / d.odd.level, 0.4);
    EXPECT_LT(d.scatter.level / d.odd.level, 2.5);
    const auto* finding = test::finding(result, "non-linear-distortion");
    ASSERT_NE(finding, nullptr);
    EXPECT_NE(finding->meaning.find("odd"), std::string::npos);
  }
}

/// Twenty linear drives: three tests of 0.1 % each; noise as it was made, response within its error bars.
TEST(BestLinear, ALinearDriveShowsItsNoiseAndItsResponse) {
  int alarms = 0, held = 0, lines = 0;
  double noise = 0.0;
  constexpr int kSeeds = 20;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto [result, truth] = approximated(0.0, seed);
    ASSERT_TRUE(result.distortion);
    const auto& d = *result.distortion;
    alarms += d.scatter.significant || d.even.significant || d.odd.significant ? 1 : 0;
    EXPECT_EQ(test::finding(result, "non-linear-distortion"), nullptr) << seed;
    const auto& g = result.response;
    for (std::size_t i = 0; i < g.lines(); ++i) {
      const double radius = data::confidence_radius(g.std[i], 0.95);
      held += std::abs(g.value[i] - truth.value[i]) < radius ? 1 : 0;
      ++lines;
      // Y = S G R + S v, U = S R - C S v, S = 1/(1 + C G'): Y/U - G is v (1 + C G')/R; of the white noise v a
      // line of N samples holds 2 s/sqrt(N); G' with the delay of 4 ms.
      const auto controller = *test::known(realisations(0.0, seed)).controller;
      const double f = g.frequency_hz[i];
      const auto loop = controller.response(f) * truth.value[i] * std::polar(1.0, -kTwoPi * f * 0.004);
      const double samples = static_cast<double>(kPeriod * (kPeriods - 1) * kRealisations);
      const double expected = 2.0 * kNoise / std::sqrt(samples) * std::abs(1.0 + loop) / 0.3;
      noise += std::pow(d.noise_std[i] / expected, 2);
    }
  }
  EXPECT_LE(alarms, 1);
  // 20 x 30 lines of 8 x 3 degrees of freedom each: 1.7 % of the variance for two standard deviations.
  EXPECT_NEAR(noise / lines, 1.0, 0.03);
  EXPECT_NEAR(static_cast<double>(held) / lines, 0.95, 0.03);
}

/// As many bars hold the scatter of the parameters as should: friction makes every realisation another drive.
TEST(BestLinear, ParametersOfADryDriveScatterWithinTheirErrorBars) {
  constexpr int kSeeds = 8;
  std::vector<double> stiffness, load, bars_stiffness, bars_load;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto experiment = realisations(0.2, seed);
    const auto result = test::identified(test::simulated(experiment).record, test::known(experiment));
    ASSERT_TRUE(result.model);
    const auto k = result.model->drive.estimate(fit::kStiffness),
               j = result.model->drive.estimate(fit::kLoadInertia);
    stiffness.push_back(k.value);
    bars_stiffness.push_back(k.std);
    load.push_back(j.value);
    bars_load.push_back(j.std);
  }
  // Chi-square with 7 degrees of freedom stays below 24.3 in 99.9 % of all cases.
  const auto chi_square = [](const std::vector<double>& values, const std::vector<double>& bars) {
    double mean = 0.0, sum = 0.0, square = 0.0;
    for (const double v : values) mean += v / static_cast<double>(values.size());
    for (const double v : values) sum += (v - mean) * (v - mean);
    for (const double b : bars) square += b * b / static_cast<double>(bars.size());
    return sum / square;
  };
  EXPECT_LT(chi_square(stiffness, bars_stiffness), 24.3);
  EXPECT_LT(chi_square(load, bars_load), 24.3);
}

}  // namespace
}  // namespace resonid
