// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <random>
#include <resonid/diagnostics/detail/residual_dependence.hpp>

namespace resonid::diagnostics {
namespace {

using Samples = std::vector<double>;

Samples normal_samples(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Samples x(n);
  for (double& v : x) v = normal(random);
  return x;
}

Samples coloured(Samples x) {
  for (std::size_t k = 1; k < x.size(); ++k) x[k] += 0.9 * x[k - 1];
  return x;
}

TEST(ResidualDependence, HasItsLevelForColouredNoise) {
  int found = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    const auto d = residual_dependence(coloured(normal_samples(500, seed)),
                                       coloured(normal_samples(500, 1000 + seed)), 25, {});
    if (d.probability < 0.05) ++found;
  }
  EXPECT_GE(found, 2);  // 10 expected, binomial
  EXPECT_LE(found, 22);
}

TEST(ResidualDependence, FindsAWeakOneAndSparesTheModelsOwnUncertainty) {
  const auto x = normal_samples(2000, 1), noise = normal_samples(2000, 2);
  Samples e(noise);
  for (std::size_t k = 3; k < e.size(); ++k) e[k] += 0.2 * x[k - 3];
  const auto d = residual_dependence(e, x, 10, {});
  EXPECT_LT(d.probability, 1e-6);
  EXPECT_NEAR(d.share, 0.04 / 1.04, 0.02);
  Eigen::MatrixXd uncertainty(2000, 1);
  for (Eigen::Index k = 0; k < 2000; ++k)
    uncertainty(k, 0) = k < 3 ? 0.0 : 0.2 * x[static_cast<std::size_t>(k - 3)];
  EXPECT_GT(residual_dependence(e, x, 10, uncertainty).probability, 0.01);
}

TEST(ResidualDependence, TellsNothingOfTooFewSamples) {
  EXPECT_EQ(residual_dependence(normal_samples(60, 1), normal_samples(60, 2), 25, {}).lags, 0U);
}

TEST(StaticMap, MeasuresACubicAndLeavesALineAlone) {
  const auto u = normal_samples(6000, 3), noise = normal_samples(6000, 4);
  const auto bins = bins_of(u, 12);
  std::vector<Samples> answers(12, Samples(u.size(), 0.0));
  for (std::size_t k = 0; k < u.size(); ++k) answers[bins[k]][k] = 1.0;  // G = 1
  const auto map_of = [&](double linear, double cubic) {
    Samples e(u.size());
    for (std::size_t k = 0; k < e.size(); ++k)
      e[k] = linear * u[k] + cubic * u[k] * u[k] * u[k] + 0.3 * noise[k];
    return static_map({e, u, u, u, answers}, bins, 5);
  };
  const auto line = map_of(0.5, 0.0);
  EXPECT_GT(line.probability, 0.01);
  const auto cubic = map_of(0.5, 0.1);
  EXPECT_LT(cubic.probability, 1e-6);
  EXPECT_GT(cubic.mean.back(), 3.0 * cubic.std.back());
  EXPECT_LT(cubic.mean.front(), -3.0 * cubic.std.front());
}

TEST(StaticMap, NeedsThreeLevels) {
  const Samples two = {1, -1, -1, 1, 1, -1};
  const auto bins = bins_of(two, 12);
  EXPECT_EQ(bins, (std::vector<std::size_t>{1, 0, 0, 1, 1, 0}));
  const std::vector<Samples> answers(2, two);
  EXPECT_TRUE(static_map({two, two, two, two, answers}, bins, 1).level.empty());
}

}  // namespace
}  // namespace resonid::diagnostics
