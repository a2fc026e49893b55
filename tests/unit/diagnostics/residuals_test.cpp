// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <golden.hpp>
#include <random>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::diagnostics {
namespace {

std::vector<double> white(std::size_t samples, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(samples);
  for (double& v : x) v = normal(random);
  return x;
}

std::vector<double> low_passed(std::vector<double> x, double pole) {
  double state = 0.0;
  for (double& v : x) v = state = pole * state + v;
  return x;
}

TEST(ResidualTest, WhiteResidualStaysBelowTheLimitAndAMissedPartDoesNot) {
  auto residual = white(8000, 7);
  std::vector<double> simulated(8000);
  for (std::size_t k = 0; k < simulated.size(); ++k)
    simulated[k] = std::sin(0.05 * static_cast<double>(k)) + 4.0;
  const auto good = test_residual({residual, simulated, {}, {}}, 20, 5);
  EXPECT_EQ(good.samples, 8000U);
  EXPECT_NEAR(good.limit, 2.17 / std::sqrt(8000.0), 1e-15);
  EXPECT_LT(good.with_simulated.largest, good.limit);
  EXPECT_EQ(good.with_simulated.beyond, 0U);
  EXPECT_DOUBLE_EQ(good.self.value[20], 1.0);
  EXPECT_EQ(good.self.value.size(), 41U);
  EXPECT_TRUE(good.with_input.value.empty());
  EXPECT_NEAR(good.rms, 1.0, 0.03);
  EXPECT_NEAR(good.snr_db, 10.0 * std::log10(0.5), 0.3);
  for (std::size_t k = 2; k < residual.size(); ++k) residual[k] += 0.5 * (simulated[k - 2] - 4.0);
  const auto missed = test_residual({residual, simulated, simulated, {}}, 20, 5);
  EXPECT_GT(missed.with_simulated.largest, kPracticalCorrelation);
  EXPECT_EQ(missed.with_simulated.beyond, 5U);
  EXPECT_EQ(missed.with_input.value, missed.with_simulated.value);
}

TEST(ResidualTest, FindsTheLagAndItsSign) {
  const auto x = white(5000, 1);
  std::vector<double> e(5000, 0.0);
  for (std::size_t k = 3; k < e.size(); ++k) e[k] = -x[k - 3];
  const auto test = test_residual({e, {}, x, {}}, 10, 6);
  EXPECT_EQ(test.with_input.largest_lag, 3);
  EXPECT_NEAR(test.with_input.value[13], -1.0, 0.01);  // lag 3
  EXPECT_NEAR(test.with_input.value[7], 0.0, 0.05);    // lag -3
}

TEST(ResidualTest, NegativeLagsAreShownAndNotJudged) {
  const auto e = white(5000, 2);
  std::vector<double> later(5000, 0.0);  // what feedback makes of the noise
  for (std::size_t k = 2; k < later.size(); ++k) later[k] = e[k - 2];
  const auto test = test_residual({e, {}, later, {}}, 10, 5);
  EXPECT_NEAR(test.with_input.value[8], 1.0, 0.01);
  EXPECT_LT(test.with_input.largest, 0.05);
}

TEST(ResidualTest, LimitIsExceededByThreePercentOfTheLags) {
  std::size_t beyond = 0, judged = 0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    const auto test = test_residual(
        {white(2000, 2 * seed + 100), {}, low_passed(white(2000, 2 * seed + 101), 0.9), {}}, 20, 20);
    beyond += test.with_input.beyond;
    judged += test.judged_lags;
  }
  EXPECT_NEAR(static_cast<double>(beyond) / static_cast<double>(judged), 0.03, 0.015);
}

TEST(ResidualTest, ColourWidensTheLimitAsBartlettSays) {
  double squares = 0.0, colour = 0.0;
  constexpr int kRuns = 300;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    const auto test = test_residual(
        {low_passed(white(3000, 2 * seed + 1), 0.8), {}, low_passed(white(3000, 2 * seed + 2), 0.8), {}}, 40,
        5);
    squares += std::pow(test.with_input.value[43], 2) * 3000.0;
    colour += test.with_input.colour / kRuns;
  }
  // sum over t of 0.8^2|t| = (1 + 0.64)/(1 - 0.64) = 4.56
  EXPECT_NEAR(std::sqrt(squares / kRuns), std::sqrt(1.64 / 0.36), 0.25);
  EXPECT_NEAR(colour, std::sqrt(1.64 / 0.36), 0.1);
}

TEST(ResidualTest, EmptyAndConstantAreHarmless) {
  EXPECT_TRUE(test_residual({}, 5, 5).self.value.empty());
  const std::vector<double> zero(100, 0.0), x = white(100, 3);
  const auto test = test_residual({zero, x, x, x}, 5, 5);
  EXPECT_EQ(test.with_simulated.largest, 0.0);
  EXPECT_EQ(test.rms, 0.0);
  EXPECT_LE(test_residual({x, {}, {}, {}}, 500, 500).self.value.size(), 199U);
}

/// The published closed-loop output-error recursion, written for this test alone: it stands beside the golden
/// trajectory and gives the residual whose correlations that file holds.
class Trajectory {
 public:
  Trajectory() : golden_(test::golden_json("e_expected.json")) {
    const auto ru = test::golden_column("e_tooth.csv", "ru");
    input = test::golden_column("e_tooth.csv", "u");
    const auto y = test::golden_column("e_tooth.csv", "y");
    const double ts = golden_["Ts"], kp = golden_["Kp"], ti = golden_["Ti"], kpc = golden_["Kpc"];
    // Kp (1 + Ts/Ti z/(z-1)) (1 + Kpc Ts z/(z-1))
    const std::array<double, 2> pi{kp * (1.0 + ts / ti), -kp}, position{1.0 + kpc * ts, -1.0};
    const std::array<double, 3> numerator{pi[0] * position[0], pi[0] * position[1] + pi[1] * position[0],
                                          pi[1] * position[1]};
    auto controller = *DiscreteFilter<double, 2>::create(numerator, std::array<double, 3>{1.0, -2.0, 1.0});
    const auto delay = golden_["delay_samples"].get<std::size_t>();
    Eigen::Matrix<double, 6, 1> theta, f;
    for (int i = 0; i < 6; ++i) theta(i) = golden_["theta0"][static_cast<std::size_t>(i)];
    Eigen::Matrix<double, 6, 6> p = golden_["p0"].get<double>() * Eigen::Matrix<double, 6, 6>::Identity();
    const double forgetting = golden_["lam"];
    std::vector<double> uh;
    for (std::size_t k = 0; k < y.size(); ++k) {
      for (std::size_t i = 0; i < 3; ++i) {
        f(static_cast<int>(i)) = k > i ? -simulated[k - 1 - i] : 0.0;
        f(static_cast<int>(i) + 3) = k > i + delay ? uh[k - 1 - i - delay] : 0.0;
      }
      const Eigen::Matrix<double, 6, 1> gain = p * f / (forgetting + f.dot(p * f));
      theta += gain * (y[k] - f.dot(theta));
      p = ((p - gain * (f.transpose() * p)) / forgetting).eval();
      p = (0.5 * (p + p.transpose())).eval();
      simulated.push_back(f.dot(theta));
      uh.push_back(controller.step(-simulated.back()) + ru[k]);
      residual.push_back(y[k] - simulated.back());
      parameters.push_back(theta);
    }
  }
  const nlohmann::json& golden() const { return golden_; }
  std::vector<double> residual, simulated, input;
  std::vector<Eigen::Matrix<double, 6, 1>> parameters;

 private:
  nlohmann::json golden_;
};

TEST(ResidualTest, AgreesWithTheGoldenTrajectory) {
  const Trajectory run;
  const auto& golden = run.golden();
  for (std::size_t i = 0; i < golden["k"].size(); ++i)
    for (int j = 0; j < 6; ++j)
      ASSERT_NEAR(run.parameters[golden["k"][i]](j), golden["cloe"]["theta"][i][static_cast<std::size_t>(j)],
                  1e-9);
  const auto& expected = golden["xcorr_cloe"];
  const std::size_t first = expected["first"], count = expected["count"];
  const auto part = [&](const std::vector<double>& x) { return std::span(x).subspan(first, count); };
  const auto test = test_residual({part(run.residual), part(run.simulated), part(run.input), {}}, 25, 4);
  ASSERT_EQ(expected["lags"][0], -25);
  ASSERT_EQ(test.with_input.value.size(), expected["lags"].size());
  for (std::size_t i = 0; i < test.with_input.value.size(); ++i) {
    EXPECT_NEAR(test.with_input.value[i], expected["R_eps_u"][i].get<double>(), 1e-9) << expected["lags"][i];
    EXPECT_NEAR(test.with_simulated.value[i], expected["R_eps_yhat"][i].get<double>(), 1e-9)
        << expected["lags"][i];
  }
  EXPECT_NEAR(test.limit, expected["limit_97"].get<double>(), 1e-12);
  EXPECT_EQ(kPracticalCorrelation, expected["limit_practical"].get<double>());
}

}  // namespace
}  // namespace resonid::diagnostics
