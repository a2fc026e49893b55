// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <experiments.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>
#include <resonid/identification/detail/figures.hpp>

namespace resonid {
namespace {

using identification::ModelChoice;
using identification::Options;
using identification::Result;

plant::ExperimentConfig swept(std::uint64_t seed) {
  auto c = test::published_drive(0.1, 10.0, seed);
  test::sweep(c);
  return c;
}

plant::ExperimentConfig random(std::uint64_t seed, double delay_s = 0.004) {
  auto c = test::published_drive(0.1, 10.0, seed);
  test::prbs(c);
  c.measurement.delay_s = delay_s;
  return c;
}

Result black_box(const plant::ExperimentConfig& c, double known_delay_s, Options options = {}) {
  options.model = ModelChoice::black_box;
  options.delay_s = known_delay_s;
  return test::identified(test::simulated(c).record, options);
}

bool integrator_is_fixed(const Result& result) { return result.black_box->model.realisation.integrator; }

std::size_t order_of(const Result& result) {
  return result.black_box->model.transfer_function.denominator.size() - 1;
}

/// A two-mass drive is of order three, one pole of it an integrator.
TEST(BlackBoxOfADrive, HasOrderThreeAndAnIntegrator) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    for (const auto& c : {swept(seed), random(seed)}) {
      const auto result = black_box(c, c.measurement.delay_s);
      EXPECT_EQ(order_of(result), 3U) << seed;
      EXPECT_TRUE(integrator_is_fixed(result)) << seed;
      EXPECT_TRUE(result.black_box->converged && result.black_box->stable) << seed;
      EXPECT_FALSE(result.black_box->further_delay) << seed;
    }
}

TEST(BlackBoxOfADrive, FindsADelayThatIsNotToldToAFractionOfASample) {
  for (const double delay_s : {0.004, 0.0047, 0.007}) {
    const auto result = black_box(random(1, delay_s), 0.0);
    EXPECT_EQ(order_of(result), 3U) << delay_s;
    ASSERT_TRUE(result.black_box->further_delay) << delay_s;
    test::expect_within(*result.black_box->further_delay, delay_s, 3.5, 0.02);
    EXPECT_NE(test::finding(result, "further-delay"), nullptr);
  }
  const auto result = black_box(swept(1), 0.0);
  EXPECT_EQ(order_of(result), 3U);
  ASSERT_TRUE(result.black_box->further_delay);
  test::expect_within(*result.black_box->further_delay, 0.004, 3.5, 0.03);
}

/// Relative rms distance to the true response with its delay, 2 ... 33 Hz.
double error_of(const Result& result, const plant::Truth& truth) {
  std::vector<double> grid;
  for (int f = 2; f <= 33; ++f) grid.push_back(f);
  const auto model = result.black_box->model.response(grid);
  double sum = 0.0;
  for (std::size_t i = 0; i < grid.size(); ++i) {
    const auto delayed = model.value[i] * std::polar(1.0, -kTwoPi * grid[i] * result.known_delay_s);
    sum += std::norm(delayed * truth.controller->response(grid[i]) / truth.loop.at(grid[i]) - 1.0);
  }
  return std::sqrt(sum / static_cast<double>(grid.size()));
}

TEST(BlackBoxOfADrive, TakesAKnownDelayExactly) {
  for (const double delay_s : {0.004, 0.0055, 0.007}) {
    const auto c = random(2, delay_s);
    const auto result = black_box(c, delay_s);
    EXPECT_FALSE(result.black_box->further_delay) << delay_s;
    EXPECT_LT(error_of(result, test::simulated(c).truth), 0.03) << delay_s;
  }
}

TEST(BlackBoxOfADrive, GivesMarginsWithErrorBars) {
  const auto c = random(3, 0.007);
  Options options;
  options.controller = test::known(c).controller;
  const auto simulation = test::simulated(c);
  const auto result = black_box(c, 0.004, options);
  ASSERT_TRUE(result.loop);
  EXPECT_EQ(result.loop->source, "model");
  const auto& m = result.loop->margins;
  const auto t = diagnostics::loop_margins(simulation.truth.loop);
  const auto check = [](double value, double truth_value, const std::optional<double>& deviation,
                        double most) {
    ASSERT_TRUE(deviation);
    EXPECT_GT(*deviation, 0.0);
    test::expect_within({value, *deviation}, truth_value, 4.0, most);
  };
  check(*m.crossover_hz(), *t.crossover_hz(), result.loop->crossover_std_hz, 0.05);
  check(*m.phase_margin_deg(), *t.phase_margin_deg(), result.loop->phase_margin_std_deg, 0.05);
  check(m.modulus_margin, t.modulus_margin, result.loop->modulus_margin_std, 0.05);
}

TEST(BlackBoxOfADrive, IsReportedAsTheResponse) {
  Options options;
  options.method = identification::Method::model;
  const auto c = random(4);
  const auto result = black_box(c, 0.004, options);
  const auto model = result.black_box->model.response(result.response.frequency_hz);
  ASSERT_GT(result.response.lines(), 10U);
  EXPECT_EQ(result.response.value, model.value);
  EXPECT_EQ(result.response.std, model.std);
  EXPECT_GT(result.response.std.front(), 0.0);
}

/// The covariance and the replicas tell the same, where the problem is nearly linear.
TEST(BlackBoxOfADrive, IsBootstrapped) {
  for (const bool in_the_loop : {false, true}) {
    const auto c = random(5);
    Options options;
    options.bootstrap = 60;
    options.jobs = 2;
    options.order = 3;
    if (in_the_loop) {
      options.controller = test::known(c).controller;
      options.approach = Approach::indirect;
    }
    const auto result = black_box(c, 0.0, options);
    ASSERT_TRUE(result.bootstrap);
    EXPECT_LE(result.bootstrap->failed, 3U);
    const auto told = identification::figures(result);
    std::vector<std::string> compared;
    for (const auto& i : result.bootstrap->intervals) {
      const auto* figure = identification::find(told, i.name);
      ASSERT_NE(figure, nullptr) << i.name;
      if (!figure->std) continue;
      compared.push_back(i.name);
      // 60 replicas tell a standard deviation to 9 %; 3.5 of that.
      EXPECT_NEAR(i.std / *figure->std, 1.0, 0.33) << i.name << (in_the_loop ? " loop" : "");
    }
    for (const char* name : {"resonance_hz", "antiresonance_hz", "delay", "phase_margin_deg"})
      EXPECT_EQ(std::count(compared.begin(), compared.end(), name), 1) << name;
  }
}

}  // namespace
}  // namespace resonid
