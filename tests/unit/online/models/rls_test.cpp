// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <resonid/online/models/rls.hpp>
#include <vector>

#include "allocation_counter.hpp"

namespace resonid::online {
namespace {

constexpr std::size_t kN = 4;
using Rls = RecursiveLeastSquares<double, kN>;
using Vector = Rls::Vector;
constexpr std::array<double, kN> kTruth{1.0, -2.0, 0.5, 3.0};

struct Equation {
  Vector regressor;
  double value;
};

/// Regressors that differ in size and depend on each other; white errors of standard deviation `noise`.
std::vector<Equation> equations(std::size_t count, double noise, std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<Equation> list(count);
  double slow = 0.0;
  for (Equation& e : list) {
    slow = 0.9 * slow + normal(generator);
    e.regressor = {slow, 0.2 * normal(generator), slow + normal(generator), 5.0 * normal(generator)};
    e.value = noise * normal(generator);
    for (std::size_t i = 0; i < kN; ++i) e.value += e.regressor[i] * kTruth[i];
  }
  return list;
}

void run(Rls& rls, const std::vector<Equation>& list) {
  for (const Equation& e : list) rls.step(e.regressor, e.value);
}

/// Weighted least squares with a prior, solved at once.
struct Batch {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d moment = Eigen::Vector4d::Zero();
  void add(const Equation& e, double forget, double weight = 1.0) {
    const Eigen::Map<const Eigen::Vector4d> f(e.regressor.data());
    information = forget * information + weight * f * f.transpose();
    moment = forget * moment + weight * f * e.value;
  }
};

TEST(RecursiveLeastSquares, EqualsTheBatchSolution) {
  for (const double factor : {1.0, 0.97}) {
    auto rls = Rls::create({.start_variance = 4.0, .factor = factor}).value();
    Batch batch;
    batch.information = Eigen::Matrix4d::Identity() / 4.0;
    for (const Equation& e : equations(500, 0.3, 1)) {
      rls.step(e.regressor, e.value, 0.7);
      batch.add(e, factor, 0.7);
    }
    const Eigen::Vector4d solution = batch.information.ldlt().solve(batch.moment);
    for (std::size_t i = 0; i < kN; ++i)
      EXPECT_NEAR(rls.parameters()[i], solution(static_cast<int>(i)), 1e-10);
    const Eigen::Matrix4d inverse = batch.information.inverse();
    EXPECT_LT((rls.information_inverse() - inverse).norm(), 1e-10 * inverse.norm());
  }
}

TEST(RecursiveLeastSquares, DirectionalForgettingReplacesInformationAboutTheRegressorOnly) {
  constexpr double kFactor = 0.9;
  auto rls = Rls::create({.forgetting = Forgetting::directional, .factor = kFactor}).value();
  Eigen::Matrix4d information = Eigen::Matrix4d::Identity();
  Eigen::Vector4d theta = Eigen::Vector4d::Zero();
  for (const Equation& e : equations(300, 0.1, 2)) {
    const Eigen::Map<const Eigen::Vector4d> f(e.regressor.data());
    const Eigen::Matrix4d p = information.inverse();
    const double spread = f.dot(p * f);
    theta += p * f * (e.value - f.dot(theta)) / (1.0 + spread);
    information += (kFactor - (1.0 - kFactor) / spread) * f * f.transpose();
    rls.step(e.regressor, e.value);
  }
  const Eigen::Matrix4d inverse = information.inverse();
  EXPECT_LT((rls.information_inverse() - inverse).norm(), 1e-8 * inverse.norm());
  for (std::size_t i = 0; i < kN; ++i) EXPECT_NEAR(rls.parameters()[i], theta(static_cast<int>(i)), 1e-8);

  const auto before = rls.information_inverse();
  for (int k = 0; k < 1000; ++k) rls.step({}, 0.0);  // silence forgets nothing
  EXPECT_EQ(before, rls.information_inverse());
}

TEST(RecursiveLeastSquares, CovarianceIsTheScatterOverSeeds) {
  constexpr int kSeeds = 400;
  for (const double factor : {1.0, 0.95}) {
    std::array<double, kN> scatter{}, claimed{};
    for (int seed = 1; seed <= kSeeds; ++seed) {
      auto rls = Rls::create({.start = kTruth, .start_variance = 1e4, .factor = factor}).value();
      run(rls, equations(400, 0.5, static_cast<std::uint64_t>(seed)));
      const auto covariance = rls.covariance();
      for (std::size_t i = 0; i < kN; ++i) {
        scatter[i] += std::pow(rls.parameters()[i] - kTruth[i], 2) / kSeeds;
        claimed[i] += covariance(static_cast<int>(i), static_cast<int>(i)) / kSeeds;
      }
    }
    // A variance over 400 seeds is known to 7 %.
    for (std::size_t i = 0; i < kN; ++i)
      EXPECT_NEAR(scatter[i] / claimed[i], 1.0, 0.25) << factor << " " << i;
  }
}

TEST(RecursiveLeastSquares, ResidualVarianceIsThatOfTheErrors) {
  auto rls = Rls::create({.start_variance = 100.0, .factor = 0.99}).value();
  double mean = 0.0;
  const auto list = equations(20000, 0.5, 3);
  for (std::size_t k = 0; k < list.size(); ++k) {
    rls.step(list[k].regressor, list[k].value);
    if (k >= 1000) mean += rls.residual_variance() / static_cast<double>(list.size() - 1000);
  }
  EXPECT_NEAR(mean, 0.25, 0.25 * 0.04);
  EXPECT_NEAR(rls.memory_samples(), 100.0, 1e-6);
}

TEST(RecursiveLeastSquares, VariableForgettingFollowsAJumpFaster) {
  std::array<double, 2> error{};
  for (int variable = 0; variable < 2; ++variable) {
    auto rls = Rls::create({.forgetting = variable == 1 ? Forgetting::variable : Forgetting::constant,
                            .factor = 0.995})
                   .value();
    run(rls, equations(2000, 0.1, 4));
    auto changed = equations(100, 0.1, 5);
    for (Equation& e : changed) e.value += 1.0 * e.regressor[0];
    run(rls, changed);
    error[static_cast<std::size_t>(variable)] = std::abs(rls.parameters()[0] - 2.0);
  }
  EXPECT_GT(error[0], 0.2);
  EXPECT_LT(error[1], 0.25 * error[0]);
}

TEST(RecursiveLeastSquares, SilenceHoldsTheEstimateAndIsReported) {
  auto rls = Rls::create({.factor = 0.98, .largest_variance = 100.0}).value();
  run(rls, equations(500, 0.1, 6));
  EXPECT_TRUE(rls.excited());
  const Vector before = rls.parameters();
  for (int k = 0; k < 100000; ++k) rls.step({}, 0.0);
  EXPECT_FALSE(rls.excited());
  EXPECT_EQ(rls.parameters(), before);
  const auto p = rls.information_inverse();
  const double most = 100.0 * std::pow(0.98, -static_cast<double>(Rls::kLimitInterval));
  for (int i = 0; i < static_cast<int>(kN); ++i) EXPECT_LE(p(i, i), most);
  run(rls, equations(500, 0.1, 7));
  EXPECT_TRUE(rls.excited());
  for (std::size_t i = 0; i < kN; ++i) EXPECT_NEAR(rls.parameters()[i], kTruth[i], 0.3);
}

TEST(RecursiveLeastSquares, OneSilentDirectionDoesNotStopTheOthers) {
  auto rls = Rls::create({.factor = 0.98, .largest_variance = 100.0}).value();
  run(rls, equations(500, 0.1, 6));
  auto changed = equations(5000, 0.1, 8);
  for (Equation& e : changed) {
    e.value += e.regressor[3] - e.regressor[1] * kTruth[1];
    e.regressor[1] = 0.0;
  }
  run(rls, changed);
  EXPECT_FALSE(rls.excited());
  EXPECT_NEAR(rls.parameters()[1], kTruth[1], 0.2);
  EXPECT_NEAR(rls.parameters()[3], kTruth[3] + 1.0, 0.02);
}

TEST(RecursiveLeastSquares, TheLowerLimitKeepsItAlert) {
  std::array<double, 2> error{};
  for (int limited = 0; limited < 2; ++limited) {
    auto rls =
        Rls::create({.forgetting = Forgetting::none, .smallest_variance = limited == 1 ? 1e-3 : 0.0}).value();
    run(rls, equations(20000, 0.1, 9));
    auto changed = equations(3000, 0.1, 10);
    for (Equation& e : changed) e.value += e.regressor[0];
    run(rls, changed);
    error[static_cast<std::size_t>(limited)] = std::abs(rls.parameters()[0] - (kTruth[0] + 1.0));
  }
  EXPECT_GT(error[0], 0.8);
  EXPECT_LT(error[1], 0.1);
}

TEST(RecursiveLeastSquares, ScaleSetsTheStartAndHeldParametersStay) {
  const std::array<double, kN> start{0.5, 0.5, 0.5, 0.5}, scale{1.0, 0.2, 1.5, 5.0};
  const std::array<bool, kN> fixed{false, true, false, false};
  auto rls = Rls::create({.start = start, .start_variance = 2.0, .scale = scale, .fixed = fixed}).value();
  const auto p = rls.information_inverse();
  EXPECT_DOUBLE_EQ(p(0, 0), 2.0);
  EXPECT_DOUBLE_EQ(p(1, 1), 0.0);
  EXPECT_DOUBLE_EQ(p(3, 3), 2.0 / 25.0);
  run(rls, equations(300, 0.1, 11));
  EXPECT_EQ(rls.parameters()[1], 0.5);
  EXPECT_NE(rls.parameters()[0], 0.5);
  EXPECT_TRUE(rls.excited());
}

TEST(RecursiveLeastSquares, MissingSamplesDoNotPoison) {
  auto whole = Rls::create({}).value();
  run(whole, equations(200, 0.1, 12));
  auto holed = whole;
  const double nan = std::numeric_limits<double>::quiet_NaN(), most = std::numeric_limits<double>::max();
  EXPECT_FALSE(holed.step({1.0, nan, 0.0, 0.0}, 1.0));
  EXPECT_FALSE(holed.step({1.0, 0.0, 0.0, 0.0}, nan));
  EXPECT_FALSE(holed.step({most, most, 0.0, 0.0}, 1.0));
  EXPECT_FALSE(holed.step({1.0, 0.0, 0.0, 0.0}, 1.0, 0.0));
  EXPECT_EQ(holed.skipped_samples(), 4U);
  EXPECT_EQ(holed.parameters(), whole.parameters());
  EXPECT_EQ(holed.information_inverse(), whole.information_inverse());
}

TEST(RecursiveLeastSquares, ResetReproducesBitForBitWithoutHeap) {
  const auto list = equations(300, 0.1, 13);
  auto rls = Rls::create({.forgetting = Forgetting::variable}).value();
  const std::size_t before = test::allocations();
  run(rls, list);
  const Vector first = rls.parameters();
  const auto covariance = rls.covariance();
  rls.reset();
  run(rls, list);
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(rls.parameters(), first);
  EXPECT_EQ(rls.covariance(), covariance);
}

/// Ten million updates, with excitation off half of the time: nothing grows, nothing turns negative.
template <class Real>
void expect_endurance(Forgetting forgetting, double largest) {
  using Long = RecursiveLeastSquares<Real, 6>;
  auto rls = Long::create({.forgetting = forgetting, .factor = 0.99, .largest_variance = largest}).value();
  std::array<Real, 6> truth{Real(1.0), Real(-0.5), Real(0.8), Real(0.1), Real(0.2), Real(0.8)};
  std::uint64_t state = 88172645463325252ULL;
  const auto uniform = [&state] {
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return static_cast<Real>(static_cast<double>(state >> 11) * 0x1p-53 - 0.5);
  };
  typename Long::Vector f{};
  constexpr int kBlock = 50000, kBlocks = 50;
  for (int block = 0; block < kBlocks; ++block) {
    const bool excited = block % 2 == 0;
    const auto held = rls.parameters();
    for (int k = 0; k < kBlock; ++k) {
      for (std::size_t i = 5; i > 0; --i) f[i] = Real(0.9) * f[i - 1];
      f[0] = excited ? uniform() : Real(0);
      Real value = excited ? Real(0.1) * uniform() : Real(0);
      for (std::size_t i = 0; i < 6; ++i) value += f[i] * truth[i];
      rls.step(f, value);
    }
    const auto p = rls.information_inverse();
    ASSERT_TRUE(p.allFinite());
    ASSERT_EQ(p, p.transpose());
    for (int i = 0; i < 6; ++i) ASSERT_GT(p(i, i), Real(0));
    ASSERT_LT(p.trace(), Real(6.0 * 1.2 * largest));
    ASSERT_EQ(rls.excited(), excited) << block;
    for (std::size_t i = 0; i < 6; ++i) ASSERT_NEAR(rls.parameters()[i], excited ? truth[i] : held[i], 0.05);
  }
}

TEST(RecursiveLeastSquares, EnduresMillionsOfUpdatesWithAndWithoutExcitation) {
  expect_endurance<double>(Forgetting::constant, 1e4);
  expect_endurance<double>(Forgetting::directional, 1e4);
  expect_endurance<double>(Forgetting::variable, 1e4);
  expect_endurance<float>(Forgetting::constant, 1e2);
}

TEST(RecursiveLeastSquares, RefusesWhatCannotWork) {
  const std::array<double, 3> three{1.0, 1.0, 1.0};
  const std::array<double, kN> zero{1.0, 0.0, 1.0, 1.0};
  const auto field = [](const RecursiveLeastSquaresConfig& c) { return Rls::create(c).error().field; };
  EXPECT_EQ(field({.start = three}), "start");
  EXPECT_EQ(field({.start_variance = 0.0}), "start_variance");
  EXPECT_EQ(field({.scale = zero}), "scale");
  EXPECT_EQ(field({.factor = 1.01}), "factor");
  EXPECT_EQ(field({.forgetting = Forgetting::variable, .factor = 0.9, .smallest_factor = 0.95}),
            "smallest_factor");
  EXPECT_EQ(field({.noise_variance = -1.0}), "noise_variance");
  EXPECT_EQ(field({.largest_variance = 0.5}), "largest_variance");
  EXPECT_EQ(field({.smallest_variance = 2.0}), "smallest_variance");
}

}  // namespace
}  // namespace resonid::online
