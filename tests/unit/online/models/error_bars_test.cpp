// SPDX-License-Identifier: MIT
// The parts that the error bars of instrumental variables and CLOE are made of.
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <random>
#include <resonid/online/models/detail/instrumental_sums.hpp>
#include <resonid/online/models/detail/stiffness_motion.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/positive_real.hpp>
#include <tooth_belt.hpp>
#include <vector>

namespace resonid::online {
namespace {

/// r(t) as it is told.
double told(const ErrorCorrelation<double>& r, int t) {
  if (t == 0) return 1.0;
  return (r.near + r.far * t) * std::pow(r.pole, t);
}

TEST(ErrorCorrelation, IsThatOfTheFiltersImpulseResponse) {
  for (const double pole : {0.9, 0.98})
    for (const int times : {1, 2}) {
      std::vector<double> h(4000, 0.0);
      h[0] = 1.0;
      for (int n = 0; n < times; ++n) {
        double past = 0.0, value = 0.0;
        for (double& x : h) {
          value = pole * value + x - past;
          past = x;
          x = value;
        }
      }
      const auto at = [&](std::ptrdiff_t t) {
        return std::inner_product(h.begin() + t, h.end(), h.begin(), 0.0);
      };
      const auto r = ErrorCorrelation<double>::high_passed(pole, times);
      for (const int t : {1, 2, 3, 10, 50})
        EXPECT_NEAR(told(r, t), at(t) / at(0), 1e-12) << pole << " " << times << " " << t;
    }
  EXPECT_EQ(told(ErrorCorrelation<double>::high_passed(0.98, 0), 1), 0.0);
}

// R^-1 (sum_i sum_j lambda^i lambda^j r(i - j) z_i z_j' + what is frozen) R^-T, summed up directly.
TEST(InstrumentalSums, TheCovarianceIsTheDoubleSum) {
  constexpr std::size_t kN = 3, kSamples = 60;
  constexpr double kFactor = 0.95;
  const auto r = ErrorCorrelation<double>::high_passed(0.9, 2);
  InstrumentalSums<double, kN> sums(r);
  sums.reset({});
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> z(kSamples), f(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (int i = 0; i < 3; ++i) f[k][i] = (z[k][i] = normal(random)) + 0.3 * normal(random);
    sums.add({z[k][0], z[k][1], z[k][2]}, {f[k][0], f[k][1], f[k][2]}, normal(random), kFactor);
  }
  const InstrumentalSums<double, kN>::Prior prior{{2.0, 1.0, 3.0}, {0.1, 0.2, 0.3}};
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero(), v = Eigen::Matrix3d::Zero();
  const auto weight = [&](std::size_t k) { return std::pow(kFactor, static_cast<double>(kSamples - 1 - k)); };
  for (std::size_t k = 0; k < kSamples; ++k) {
    matrix += weight(k) * z[k] * f[k].transpose();
    for (std::size_t l = 0; l < kSamples; ++l)
      v += weight(k) * weight(l) * told(r, std::abs(static_cast<int>(k) - static_cast<int>(l))) * z[k] *
           z[l].transpose();
  }
  const double start = std::pow(kFactor, static_cast<double>(kSamples));
  for (int i = 0; i < 3; ++i) {
    const auto at = static_cast<std::size_t>(i);
    matrix(i, i) += start * prior.start[at] + prior.frozen[at];
    v(i, i) += start * start * prior.start[at] + prior.frozen[at];
  }
  const Eigen::Matrix3d inverse = matrix.inverse(), expected = inverse * v * inverse.transpose();
  const auto found = sums.covariance(prior);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(found[static_cast<std::size_t>(3 * i + j)], expected(i, j), 1e-12 * expected.norm());
}

// Against the machine with another stiffness, of which the direction is the derivative.
TEST(StiffnessDirection, IsTheChangeOfTheModel) {
  constexpr double kStep = 1e-5;
  for (const double ts : {0.001, 0.004})
    for (const double place : {0.4, 1.6}) {
      const auto model = test::tooth_belt(place, ts, 10.0);
      const SampledModes<3> modes(model, 1.0);
      const auto above = modes.with_first_resonance_scaled(1.0 + kStep);
      const auto below = modes.with_first_resonance_scaled(1.0 - kStep);
      const auto found = StiffnessDirection<double, 3>::of(model);
      for (std::size_t i = 0; i < 3; ++i) {
        const double b = (above.b[i] - below.b[i]) / (2.0 * kStep),
                     a = (above.a[i] - below.a[i]) / (2.0 * kStep);
        EXPECT_NEAR(found.change.b[i], b, 1e-5 * std::abs(b)) << ts << " " << place << " b" << i;
        EXPECT_NEAR(found.change.a[i], a, 1e-5 * std::abs(a)) << ts << " " << place << " a" << i;
      }
      const auto mode = modes.resonances()[0];
      EXPECT_NEAR(found.decay, mode.damping_ratio * kTwoPi * mode.frequency_hz, 1e-9);
    }
}

TEST(StiffnessDirection, IsNothingWhereNothingOscillates) {
  const DiscreteModel<double, 3> real_poles{{0.1, 0.0, 0.0}, {-1.9, 1.05, -0.15}};
  const auto found = StiffnessDirection<double, 3>::of(real_poles);
  EXPECT_EQ(found.decay, 0.0);
  EXPECT_EQ(found.change.b, (std::array<double, 3>{}));
  EXPECT_EQ((StiffnessDirection<double, 1>::of({{0.1}, {-1.0}}).decay), 0.0);
  const double nan = std::nan("");
  EXPECT_EQ((StiffnessDirection<double, 3>::of({{0.1, 0.1, 0.1}, {nan, nan, nan}}).decay), 0.0);
}

TEST(StiffnessMotion, ExplainsTheLagAndLeavesTheNoise) {
  constexpr double kMoved = 0.01, kNoise = 0.003, kFactor = 0.99;
  StiffnessMotion<double> motion;
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal;
  double squares = 0.0, all = 0.0;
  constexpr int kSettling = 1000, kSamples = 20000;
  for (int k = 0; k < kSamples; ++k) {
    const double moving = normal(random), error = kMoved * moving + kNoise * normal(random);
    const double rest = motion.see(moving, moving, error, kFactor);
    if (k < kSettling) continue;
    squares += rest * rest;
    all += error * error;
  }
  const double noise = kNoise * kNoise * (kSamples - kSettling);
  EXPECT_NEAR(squares, 1.005 * noise, 0.03 * noise);  // and its own error: half of 1 - lambda
  EXPECT_GT(all, 10.0 * noise);
  EXPECT_NEAR(motion.moved(), kMoved, 4.0 * kNoise * std::sqrt(0.005));
}

TEST(StiffnessMotion, FadesToNothingWithoutExcitation) {
  StiffnessMotion<float> motion;
  motion.see(1.0F, 1.0F, 0.5F, 0.9F);
  for (int k = 0; k < 2000; ++k) {
    motion.see(0.0F, 0.0F, 0.1F, 0.9F);
    motion.flush();
  }
  EXPECT_EQ(motion.moved(), 0.0F);
  EXPECT_EQ(motion.weight(), 0.0F);
}

/// Of the damped closed-loop output error on the belt.
PseudoLinearRecursion<3> damped() {
  PseudoLinearRecursion<3> r;
  r.model = r.gradient_model = test::tooth_belt(1.0, 0.004, 10.0);
  r.delay_samples = 1;
  r.controller = test::tooth_belt_controller(0.004);
  r.error = RegressorFilter::sensitivity;
  r.gradient = RegressorFilter::inverse_a;
  r.gradient_contraction = 0.8;
  return r;
}

TEST(OfErrors, IsLinearInBothSharesAndNeverNegative) {
  const PositiveReal<3> average(damped());
  const Eigen::Matrix<double, 6, 6> p = Eigen::Matrix<double, 6, 6>::Identity();
  const auto noise = average.of_errors(p, 1.0, 0.0), motion = average.of_errors(p, 0.0, 1.0);
  const auto both = average.of_errors(p, 0.3, 2.0);
  EXPECT_LT((both - 0.3 * noise - 2.0 * motion).norm(), 1e-9 * both.norm());
  for (const auto& m : {noise, motion}) EXPECT_EQ((m + 1e-9 * m.norm() * p).llt().info(), Eigen::Success);
}

// The controller off, S = 1: white noise is as white in the error. The last parameter is not estimated.
TEST(OfErrors, LeavesPAsItIsWithoutFeedback) {
  auto r = damped();
  r.controller = {};
  r.fixed_integrator = true;
  Eigen::Matrix<double, 6, 6> p = Eigen::Matrix<double, 6, 6>::Identity();
  p(0, 1) = p(1, 0) = 0.4;
  const Eigen::Matrix<double, 6, 6> rest = PositiveReal<3>(r).of_errors(p, 2.0, 0.0) - 2.0 * p;
  EXPECT_LT((rest.topLeftCorner<5, 5>().norm()), 1e-9);
}

}  // namespace
}  // namespace resonid::online
