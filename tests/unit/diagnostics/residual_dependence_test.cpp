// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cmath>
#include <random>
#include <resonid/diagnostics/detail/residual_dependence.hpp>
#include <sanitized.hpp>
#include <uniformity.hpp>

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
  EXPECT_GT(residual_dependence(e, x, 10, {uncertainty, false}).probability, 0.01);
}

TEST(ResidualDependence, TakesOutWhatTheParametersHaveUsedUp) {
  std::vector<double> aware, unaware;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto x = normal_samples(1000, seed);
    auto e = normal_samples(1000, 500 + seed);
    // Five parameters that are gains at lags 1 ... 5, fitted: the residual is orthogonal to them.
    Eigen::MatrixXd moved = Eigen::MatrixXd::Zero(1000, 5);
    for (Eigen::Index j = 0; j < 5; ++j)
      for (Eigen::Index k = j + 1; k < 1000; ++k) moved(k, j) = x[static_cast<std::size_t>(k - j - 1)];
    Eigen::Map<Eigen::VectorXd> residual(e.data(), 1000);
    residual -= moved * (moved.transpose() * moved).ldlt().solve(moved.transpose() * residual);
    aware.push_back(residual_dependence(e, x, 10, {moved, true}).probability);
    unaware.push_back(residual_dependence(e, x, 10).probability);
  }
  EXPECT_GT(test::uniformity(aware), 1e-3);
  EXPECT_LT(test::uniformity(unaware), 1e-6);
}

/// An integrator in a loop with a chirp, and noise on its output.
struct Loop {
  Samples input, simulated, noise, answer;
};
Loop closed_loop(std::size_t n, unsigned seed) {
  Loop loop{Samples(n), Samples(n), normal_samples(n, seed), {}};
  double y = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    const double t = static_cast<double>(k) / static_cast<double>(n);
    loop.simulated[k] = y;
    loop.input[k] = std::cos(400.0 * t * (1.0 - 0.4 * t)) - 0.3 * (y + 0.1 * loop.noise[k]);
    y += 0.2 * loop.input[k];
    loop.noise[k] *= 0.1;
  }
  return loop;
}

TEST(ResidualDependence, SeesOneLineOfManyAndNoOther) {
  std::vector<double> none;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto x = normal_samples(2000, seed), e = coloured(normal_samples(2000, 900 + seed));
    none.push_back(dependence_at(e, x, {10.0, 1.0, 100.0, seed % 2 == 0}));
  }
  EXPECT_GT(test::uniformity(none), 1e-3);
  const auto x = normal_samples(2000, 7);
  auto e = normal_samples(2000, 8);
  double y1 = 0.0, y2 = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {  // a resonance at 10 Hz of 100 Hz
    const double y = 2.0 * 0.95 * std::cos(0.2 * 3.14159265) * y1 - 0.95 * 0.95 * y2 + 0.2 * x[k];
    e[k] += y;
    y2 = y1, y1 = y;
  }
  EXPECT_LT(dependence_at(e, x, {10.0, 1.0, 100.0, false}), 1e-6);
  EXPECT_LT(dependence_at(e, x, {10.0, 1.0, 100.0, true}), 1e-4);
  EXPECT_GT(dependence_at(e, x, {35.0, 1.0, 100.0, false}), 1e-3);
}

/// Peak of the process, in MB.
double peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1e-3 * static_cast<double>(usage.ru_maxrss);
}

TEST(ResidualDependence, TakesNoMemoryPerLag) {
  if (RESONID_SANITIZED != 0) GTEST_SKIP() << "a sanitizer keeps what is freed";
  const auto x = normal_samples(400000, 1), e = normal_samples(400000, 2);
  const double before = peak_memory();
  EXPECT_GT(residual_dependence(e, x, 25).probability, 1e-4);
  EXPECT_LT(peak_memory() - before, 40.0);  // one column: 3.2 MB
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

TEST(StaticMap, ReadsNoFrictionFromTheNoiseOfASmoothlyDrivenLoop) {
  std::vector<double> right, with_present;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const auto loop = closed_loop(1500, seed);
    Samples velocity(loop.simulated);
    for (std::size_t k = 0; k < velocity.size(); ++k) velocity[k] += loop.noise[k];
    const auto bins = bins_of(velocity, 6);
    std::vector<Samples> answers(6, Samples(velocity.size(), 0.0));
    for (std::size_t b = 0; b < 6; ++b)
      for (std::size_t k = 1; k < velocity.size(); ++k)
        answers[b][k] = answers[b][k - 1] + (bins[k - 1] == b ? 0.2 : 0.0);
    const auto map_from = [&](std::size_t first_lag) {
      return static_map({loop.noise, loop.input, loop.simulated, velocity, answers, first_lag}, bins, 10)
          .probability;
    };
    right.push_back(map_from(1));
    with_present.push_back(map_from(0));
  }
  EXPECT_GT(test::uniformity(right), 1e-3);
  EXPECT_LT(test::uniformity(with_present), 1e-6);
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
