// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <resonid/fit/detail/controller_estimate.hpp>

namespace resonid::fit {
namespace {

/// An inertia with noise on its velocity under a PI controller (3.15 - 3.108 z^-1)/(1 - z^-1), white
/// excitation, noise on the recorded torque.
data::Record loop(double input_noise, unsigned seed, double limit = 1e9) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise;
  data::Record r;
  r.sample_rate_hz = 500.0;
  double velocity = 10.0, integral = 0.0;
  for (int k = 0; k < 8000; ++k) {
    const double y = velocity + 0.3 * noise(generator);
    const double error = 10.0 - y, ru = 2.0 * noise(generator);
    integral += 0.042 * error;
    const double u = std::clamp(ru + 3.108 * error + integral, -limit, limit);
    velocity += 0.03 * u;
    r.excitation.samples.push_back(ru);
    r.input.samples.push_back(u + input_noise * noise(generator));
    r.output.samples.push_back(y);
    r.reference.samples.push_back(10.0);
  }
  return r;
}

TEST(ControllerEstimate, IsExactWithoutNoise) {
  const auto c = estimate_controller(loop(0.0, 1));
  ASSERT_TRUE(c.has_value());
  EXPECT_EQ(c->input_noise, 0.0);
  EXPECT_FALSE(c->model.has_value());
  EXPECT_NEAR(c->controller.numerator[0], 3.15, 1e-6);
}

TEST(ControllerEstimate, HoldsTheTruthWithinItsErrorBars) {
  double sum = 0.0;
  constexpr int kSeeds = 12;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto c = estimate_controller(loop(0.2, seed));
    ASSERT_TRUE(c.has_value());
    EXPECT_NEAR(c->input_noise, 0.2, 0.01);
    const std::vector<double> hz = {20.0};
    const auto g = c->model->response(hz);
    const auto z = std::polar(1.0, -2.0 * M_PI * hz[0] / 500.0);
    const auto truth = (3.15 - 3.108 * z) / (1.0 - z);
    sum += std::norm(g.value[0] - truth) / std::pow(g.std[0], 2) / kSeeds;
    EXPECT_LT(g.std[0], 0.02 * std::abs(truth));
  }
  // The mean of 12 squares of unit mean: gamma distributed, 0.1 ... 99.9 %.
  EXPECT_GT(sum, 0.2);
  EXPECT_LT(sum, 2.7);
}

TEST(ControllerEstimate, NeedsNoReferenceThatRests) {
  auto record = loop(0.2, 3);
  record.reference = {};
  const auto c = estimate_controller(record);
  ASSERT_TRUE(c.has_value());
  EXPECT_NEAR(c->controller.numerator[0], 3.15, 0.05);
}

TEST(ControllerEstimate, IsNoneWhereTheInputIsLimited) {
  EXPECT_FALSE(estimate_controller(loop(0.2, 1, 2.5)).has_value());
}

TEST(ControllerEstimate, IsNoneWithoutFeedback) {
  auto record = loop(0.2, 1);
  std::mt19937 generator(5);
  std::normal_distribution<double> noise;
  for (std::size_t k = 0; k < record.samples(); ++k)
    record.input.samples[k] = record.excitation.samples[k] + 0.1 * noise(generator);
  EXPECT_FALSE(estimate_controller(record).has_value());
}

}  // namespace
}  // namespace resonid::fit
