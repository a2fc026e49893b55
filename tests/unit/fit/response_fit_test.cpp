// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <golden.hpp>
#include <random>
#include <resonid/base/constants.hpp>
#include <resonid/fit/response_fit.hpp>

namespace resonid::fit {
namespace {

constexpr double kRadiusSquared = 0.05 * 0.05;

data::FrequencyResponse golden_response(const nlohmann::json& f, const char* approach) {
  data::FrequencyResponse g;
  g.frequency_hz = f.at("f").get<std::vector<double>>();
  g.value = test::golden_complex(f.at(approach));
  return g;
}

DriveModel start_model() {
  DriveModel start;
  start.sample_time_s = 0.002;
  start.parameters = {0.04, 0.025, 120.0, 0.4, 0.0};
  return start;
}

TEST(ResponseFit, UnweightedFitMeetsTheGoldenFit) {
  const auto golden = test::golden_json("f_expected.json");
  const auto& expected = golden.at("lm_joint_zoh_unweighted");
  ResponseFitConfig config;
  config.sample_time_s = 0.002;
  config.weighting = Weighting::none;
  config.initial = start_model();
  const auto fit = fit_response(golden_response(golden, "joint"), config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_TRUE(fit->converged);
  const auto theta = expected.at("theta").get<std::vector<double>>();
  const std::array<double, 4> unit = {1.0, 1.0, kRadiusSquared, kRadiusSquared};
  for (int i = 0; i < 4; ++i) {
    const auto k = static_cast<std::size_t>(i);
    EXPECT_NEAR(fit->model.value(static_cast<Parameter>(i)) / (theta[k] * unit[k]), 1.0, 1e-5) << i;
    for (int j = 0; j < 4; ++j) {
      const double log_covariance = fit->model.covariance(i, j) /
                                    fit->model.value(static_cast<Parameter>(i)) /
                                    fit->model.value(static_cast<Parameter>(j));
      const double wanted = expected.at("cov_log")[k][static_cast<std::size_t>(j)].get<double>();
      EXPECT_NEAR(log_covariance, wanted, 2e-5 * std::abs(wanted) + 1e-10) << i << ", " << j;
    }
  }
}

/// Noisy response of system 2 with known standard deviations.
data::FrequencyResponse noisy_response(std::uint64_t seed, double relative) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  DriveModel truth;
  truth.sample_time_s = 0.002;
  truth.parameters = {0.032, 0.032, 143.75, 0.3, 0.0};
  data::FrequencyResponse g;
  for (double f = 2.0; f <= 33.0; f += 0.5) {
    const auto value = truth.response(f);
    const double sd = relative * std::abs(value);
    g.frequency_hz.push_back(f);
    g.value.push_back(value + sd / std::sqrt(2.0) * std::complex<double>(normal(random), normal(random)));
    g.std.push_back(sd);
  }
  return g;
}

TEST(ResponseFit, FindsItsOwnStartAndStatesRightErrors) {
  int inside = 0;
  constexpr int kRuns = 60;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    ResponseFitConfig config;
    config.sample_time_s = 0.002;
    config.weighting = Weighting::deviations;
    const auto fit = fit_response(noisy_response(seed, 0.05), config);
    ASSERT_TRUE(fit.has_value());
    const auto k = fit->model.estimate(kStiffness);
    EXPECT_NEAR(k.value, 143.75, 10.0);
    if (std::abs(k.value - 143.75) < 1.96 * k.std) ++inside;
  }
  // Binomial(60, 0.95): fewer than 51 or more than 60 has a probability below 1 %.
  EXPECT_GE(inside, 51);
}

TEST(ResponseFit, ModelErrorIsFoundAndReported) {
  auto g = noisy_response(3, 0.01);
  for (std::size_t i = 0; i < g.lines(); ++i)  // a model that is 10 % wrong in a way it cannot express
    g.value[i] *= 1.0 + 0.1 * std::sin(1.7 * g.frequency_hz[i]);
  ResponseFitConfig config;
  config.sample_time_s = 0.002;
  const auto fit = fit_response(g, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->model_error, 0.07, 0.02);  // rms of the planted error
  EXPECT_GT(fit->misfit, 5.0);
  EXPECT_NEAR(fit->model.resonance().value, 15.09, 0.3);
}

TEST(ResponseFit, TrueModelNeedsNoModelError) {
  ResponseFitConfig config;
  config.sample_time_s = 0.002;
  const auto fit = fit_response(noisy_response(5, 0.02), config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_LT(fit->model_error, 0.01);
  EXPECT_NEAR(fit->misfit, 1.0, 0.25);
}

/// Ten copies of every line are no more information than one: neither may the error bars be smaller.
TEST(ResponseFit, LinesThatRepeatOneAnotherDoNotShrinkTheErrorBars) {
  const auto g = noisy_response(7, 0.05);
  data::FrequencyResponse repeated;
  for (std::size_t i = 0; i < g.lines(); ++i)
    for (int copy = 0; copy < 10; ++copy) {
      repeated.frequency_hz.push_back(g.frequency_hz[i] + 1e-6 * copy);
      repeated.value.push_back(g.value[i]);
      repeated.std.push_back(g.std[i]);
    }
  ResponseFitConfig config;
  config.sample_time_s = 0.002;
  const auto once = fit_response(g, config);
  const auto often = fit_response(repeated, config);
  const double ratio = often->model.estimate(kStiffness).std / once->model.estimate(kStiffness).std;
  EXPECT_GT(ratio, 0.75);
  EXPECT_LT(ratio, 1.35);
}

TEST(ResponseFit, FittedDelayAndFriction) {
  DriveModel truth;
  truth.sample_time_s = 0.002;
  truth.delay_s = 0.004;
  truth.parameters = {0.02, 0.05, 200.0, 0.2, 0.4};
  data::FrequencyResponse g;
  for (double f = 0.5; f <= 60.0; f *= 1.05) {
    g.frequency_hz.push_back(f);
    g.value.push_back(truth.response(f) * std::polar(1.0, -2.0 * 3.14159265358979323846 * f * truth.delay_s));
    g.std.push_back(0.01 * std::abs(g.value.back()));
  }
  ResponseFitConfig config;
  config.sample_time_s = 0.002;
  config.delay = true;
  config.viscous_friction = true;
  const auto fit = fit_response(g, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->model.delay_s, 0.004, 1e-8);
  EXPECT_NEAR(fit->model.parameters.viscous_friction, 0.4, 1e-5);
  EXPECT_NEAR(fit->model.parameters.load_inertia, 0.05, 1e-6);
}

/// By hand: an inertia J behind a hold, seen m + e samples late, is z^-(m+1) Ts/J (1/(z - 1) + 1 - e).
TEST(ResponseFit, FractionOfASampleIsSeenThroughTheHold) {
  constexpr double kInertia = 0.05, kStep = 0.002, kKnown = 0.003,
                   kFraction = 0.3;  // 1.5 samples known, 0.3 not
  data::FrequencyResponse g;
  for (double f = 5.0; f < 245.0; f += 5.0) {
    const auto z = std::polar(1.0, kTwoPi * f * kStep);
    const double e = 1.5 + kFraction - 1.0;
    const auto delayed = kStep / kInertia * (1.0 / (z - 1.0) + 1.0 - e) / (z * z);
    g.frequency_hz.push_back(f);
    g.value.push_back(delayed * std::polar(1.0, kTwoPi * f * kKnown));
    g.std.push_back(1e-3 * std::abs(delayed));
  }
  ResponseFitConfig config;
  config.structure = Structure::rigid;
  config.sample_time_s = kStep;
  config.known_delay_s = kKnown;
  config.delay = true;
  const auto fit = fit_response(g, config);
  ASSERT_TRUE(fit.has_value());
  EXPECT_NEAR(fit->model.parameters.driven_inertia, kInertia, 1e-8);
  EXPECT_NEAR(fit->model.delay_s, kFraction * kStep, 1e-8);
  const auto measured = fit->model.values(g.frequency_hz, true);
  for (std::size_t i = 0; i < measured.size(); ++i)
    EXPECT_LT(std::abs(measured[i] - g.value[i]), 1e-6 * std::abs(g.value[i]));
}

TEST(ResponseFit, RefusesWhatItCannotUse) {
  const auto g = noisy_response(1, 0.01);
  ResponseFitConfig config;
  EXPECT_EQ(fit_response(g, config).error().field, "sample_time_s");
  config.sample_time_s = 0.002;
  config.low_hz = 32.9;
  EXPECT_EQ(fit_response(g, config).error().field, "response");
  config.low_hz = 0.0;
  auto bare = g;
  bare.std.clear();
  EXPECT_EQ(fit_response(bare, config).error().field, "response");
}

TEST(DriveModel, TransferFunctionAgreesWithTheGoldenModelsAndTheResponse) {
  const auto golden = test::golden_json("models.json").at("belt2");
  DriveModel model;
  model.sample_time_s = 0.002;
  model.parameters = {0.032, 0.032, 143.75, 0.3, 0.0};
  const auto g = model.transfer_function();
  const auto a = golden.at("Ts=0.002").at("a").get<std::vector<double>>();
  const auto b = golden.at("Ts=0.002").at("b").get<std::vector<double>>();
  ASSERT_EQ(g.denominator.size(), a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_NEAR(g.denominator[i], a[i], 1e-10);
    EXPECT_NEAR(g.numerator[i], b[i], 1e-10);
  }
  for (const double f : {1.0, 10.67, 15.09, 100.0})
    EXPECT_LT(std::abs(g.response(f) - model.response(f)), 1e-8 * std::abs(model.response(f)));
}

}  // namespace
}  // namespace resonid::fit
