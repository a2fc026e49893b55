// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <random>
#include <resonid/fit/detail/noise_model.hpp>

namespace resonid::fit {
namespace {

std::vector<double> white(std::size_t n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> e(n);
  for (auto& x : e) x = normal(random);
  return e;
}

TEST(NoiseModel, WhiteNoiseHasOrderZero) {
  const auto noise = fit_noise_model(white(5000, 1), 32);
  EXPECT_EQ(noise.order(), 0U);
  EXPECT_NEAR(noise.innovation_variance, 1.0, 0.1);
}

TEST(NoiseModel, FindsAnAutoregressiveProcessAndWhitensIt) {
  auto e = white(20000, 2);
  std::vector<double> v(e.size(), 0.0);
  for (std::size_t k = 2; k < v.size(); ++k) v[k] = 1.6 * v[k - 1] - 0.81 * v[k - 2] + 0.5 * e[k];
  const auto noise = fit_noise_model(v, 32);
  ASSERT_GE(noise.order(), 2U);
  EXPECT_NEAR(noise.polynomial[1], -1.6, 0.03);
  EXPECT_NEAR(noise.polynomial[2], 0.81, 0.03);
  EXPECT_NEAR(noise.innovation_variance, 0.25, 0.02);
  const auto w = whiten(v, noise);
  EXPECT_EQ(w.size(), v.size() - noise.order());
  EXPECT_EQ(fit_noise_model(w, 32).order(), 0U);
}

TEST(NoiseModel, WhitensEverySampleByThoseBeforeIt) {
  for (const std::size_t size : {0U, 1U, 3U, 4U, 18U, 19U, 20U, 53U}) {
    const auto v = white(size, 3);
    const NoiseModel noise{{1.0, -0.7, 0.2, 0.1}, 1.0};
    const auto w = whiten(v, noise);
    ASSERT_EQ(w.size(), size > 3 ? size - 3 : 0) << size;
    for (std::size_t k = 3; k < size; ++k)
      EXPECT_NEAR(w[k - 3], v[k] - 0.7 * v[k - 1] + 0.2 * v[k - 2] + 0.1 * v[k - 3], 1e-12)
          << size << " " << k;
  }
}

TEST(NoiseModel, SilenceIsHarmless) {
  EXPECT_EQ(fit_noise_model(std::vector<double>(100, 0.0), 8).order(), 0U);
  EXPECT_EQ(fit_noise_model(std::vector<double>{}, 8).order(), 0U);
}

}  // namespace
}  // namespace resonid::fit
