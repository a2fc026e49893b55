// SPDX-License-Identifier: MIT
// Sums over what a loop does until it settles: against closed forms and against every sample.
#include "design/course.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <vector>

namespace resonid::design {
namespace {

Eigen::VectorXd column(const std::vector<double>& values) {
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

/// Two real poles, y = q^k - p^k, from rest under a constant.
struct Pair {
  double p, q;
  [[nodiscard]] Eigen::MatrixXd a() const { return column({p, q}).asDiagonal(); }
  [[nodiscard]] static Eigen::VectorXd input() { return column({1.0, 1.0}); }
  [[nodiscard]] Eigen::RowVectorXd output() const { return column({1.0 - p, q - 1.0}).transpose(); }
};

Eigen::MatrixXd turning(double radius, double angle) {
  Eigen::MatrixXd a(2, 2);
  a << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  return radius * a;
}

TEST(Course, SumsUpWhatTakesHundredsOfMillionsOfSamples) {
  const Pair slowest{1.0 - 1e-6, 1.0 - 1e-7};
  const auto whole = course_of(slowest.a(), Pair::input(), slowest.output(), slowest.q, 1e-9, 1000);
  EXPECT_NEAR(whole.absolute, 1e7 - 1e6, 1e-5 * 1e7);
}

TEST(Course, SumsUpWhatTakesAMillionSamples) {
  const Pair pair{1.0 - 1e-4, 1.0 - 1e-5};
  const auto course = course_of(pair.a(), Pair::input(), pair.output(), pair.q, 1e-9, 1000);
  // y = q^k - p^k, largest where its slope is none.
  const double at = std::log(std::log(pair.p) / std::log(pair.q)) / std::log(pair.q / pair.p);
  EXPECT_NEAR(course.sum, 1e5 - 1e4, 1e-6 * 1e5);
  EXPECT_NEAR(course.absolute, 1e5 - 1e4, 1e-6 * 1e5);
  EXPECT_NEAR(course.highest, std::pow(pair.q, at) - std::pow(pair.p, at), 1e-6);
  EXPECT_EQ(course.lowest, 0.0);
}

void expect_as_every_sample(const Eigen::MatrixXd& a, double radius, double within) {
  const Eigen::Index n = a.rows();
  const Eigen::VectorXd input = Eigen::VectorXd::LinSpaced(n, 0.5, 1.0);
  // Without what stays: y goes to zero.
  Eigen::RowVectorXd output = Eigen::RowVectorXd::LinSpaced(n, 1.0, 2.0);
  const Eigen::VectorXd rest = (Eigen::MatrixXd::Identity(n, n) - a).inverse() * input;
  output -= (output * rest) / rest.squaredNorm() * rest.transpose();
  const auto course = course_of(a, input, output, radius, 1e-9, 1000);
  double absolute = 0.0, sum = 0.0, highest = 0.0, lowest = 0.0;
  Eigen::VectorXd state = Eigen::VectorXd::Zero(n);
  for (std::size_t k = 0; k < most_samples(radius); ++k) {
    const double y = output * state;
    absolute += std::abs(y);
    sum += y;
    highest = std::max(highest, y);
    lowest = std::min(lowest, y);
    state = (a * state + input).eval();
  }
  EXPECT_NEAR(course.absolute, absolute, within * absolute);
  EXPECT_NEAR(course.sum, sum, within * absolute);
  EXPECT_NEAR(course.highest, highest, within * (highest - lowest));
  EXPECT_NEAR(course.lowest, lowest, within * (highest - lowest));
}

TEST(Course, FollowsASlowSwing) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3, 3);
  a.topLeftCorner(2, 2) = turning(1.0 - 1e-5, 1e-4);
  a(2, 2) = 0.5;
  expect_as_every_sample(a, 1.0 - 1e-5, 1e-4);
}

TEST(Course, LeavesOutNoSampleOfARingingMode) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3, 3);
  a.topLeftCorner(2, 2) = turning(1.0 - 5e-5, 1.0);
  a(2, 2) = 1.0 - 1e-4;
  expect_as_every_sample(a, 1.0 - 5e-5, 1e-8);  // it ends at 1e-9 of the largest
}

/// A pulse of about 0.7 over a tail of 1e-4, which changes its sign after ln(2)/(2 slow) samples: y is the
/// sum of weights times powers of the poles.
void expect_whole_tail(double slow, std::size_t quiet) {
  constexpr double kTail = 1e-4, kSettled = 1e-7;
  const std::vector<double> poles{0.99, 0.9, 1.0 - slow, 1.0 - 3.0 * slow};
  const std::vector<double> weights{1.0, -1.0 + kTail, kTail, -2.0 * kTail};
  // By a constant x goes to 1/(1 - pole) in each, and y to the weights' sum, which is none.
  std::vector<double> output;
  for (std::size_t i = 0; i < poles.size(); ++i) output.push_back(-weights[i] * (1.0 - poles[i]));
  const Eigen::MatrixXd a = column(poles).asDiagonal();
  const auto course =
      course_of(a, Eigen::VectorXd::Ones(4), column(output).transpose(), poles[2], kSettled, quiet);
  double absolute = 0.0, sum = 0.0;
  std::vector<double> left = weights;
  for (auto k = static_cast<std::size_t>(30.0 / slow); k > 0; --k) {
    double y = 0.0;
    for (std::size_t i = 0; i < poles.size(); ++i) {
      y += left[i];
      left[i] *= poles[i];
    }
    absolute += std::abs(y);
    sum += y;
  }
  // What is left when it ends is kSettled of the pulse over a time constant.
  const double within = kSettled / slow + 1e-6 * absolute;
  EXPECT_NEAR(course.absolute, absolute, within);
  EXPECT_NEAR(course.sum, sum, within);
}

TEST(Course, GoesOnWhereASlowTailChangesItsSign) {
  expect_whole_tail(1e-5, 20);  // in strides of 32 samples, about three of which are below
  expect_whole_tail(1e-4, 6);   // in single samples, about ten of which are below
}

TEST(ImpulseEnergy, IsThatOfEverySample) {
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(3, 3);
  a.topLeftCorner(2, 2) = turning(0.999, 0.3);
  a(2, 2) = 0.9;
  a(0, 2) = 0.2;
  const Eigen::VectorXd start = column({1.0, -2.0, 3.0});
  const Eigen::RowVectorXd output = column({0.3, 1.0, -0.5}).transpose();
  double energy = 0.0;
  Eigen::VectorXd state = start;
  for (int k = 0; k < 40'000; ++k) {
    const double y = output * state;
    energy += y * y;
    state = (a * state).eval();
  }
  EXPECT_NEAR(impulse_energy(a, start, output), energy, 1e-10 * energy);
}

TEST(ImpulseEnergy, IsExactForOneSlowPole) {
  const double pole = 1.0 - 1e-6;
  const Eigen::MatrixXd a = Eigen::MatrixXd::Constant(1, 1, pole);
  EXPECT_NEAR(impulse_energy(a, Eigen::VectorXd::Ones(1), Eigen::RowVectorXd::Ones(1)),
              1.0 / (1.0 - pole * pole), 1e-8 / (1.0 - pole * pole));
}

}  // namespace
}  // namespace resonid::design
