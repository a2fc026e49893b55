// SPDX-License-Identifier: MIT
#include "linalg/riccati.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "linalg/decompositions.hpp"

namespace resonid::linalg {
namespace {

Eigen::MatrixXd scalar(double x) { return Eigen::MatrixXd::Constant(1, 1, x); }

TEST(Riccati, ScalarByItsQuadratic) {
  // x = a^2 x r/(r + b^2 x) + q
  for (const double a : {0.0, 0.5, 1.0, 1.7}) {
    const double b = 0.3, q = 2.0, r = 0.1;
    const auto x = solve_riccati(scalar(a), scalar(b), scalar(q), scalar(r));
    ASSERT_TRUE(x);
    const double p = r * (1.0 - a * a) - b * b * q;
    EXPECT_NEAR((*x)(0, 0) / ((-p + std::sqrt(p * p + 4.0 * b * b * q * r)) / (2.0 * b * b)), 1.0, 1e-12)
        << a;
  }
}

TEST(Riccati, SolutionSatisfiesTheEquationAndMakesStable) {
  Eigen::MatrixXd a(4, 4), b(4, 2);
  a << 1.2, 0.3, 0.0, 0.1, -0.4, 0.9, 0.2, 0.0, 0.0, 0.0, 0.0, 1.0, 0.1, 0.0, 0.0,
      0.0;  // unstable and singular
  b << 0.0, 0.1, 1.0, 0.0, 0.0, 0.0, 0.2, 1.0;
  const Eigen::MatrixXd q = Eigen::Vector4d(1.0, 0.0, 1e-6, 1e4).asDiagonal();
  const Eigen::MatrixXd r = Eigen::Vector2d(0.5, 3.0).asDiagonal();
  const auto x = solve_riccati(a, b, q, r);
  ASSERT_TRUE(x);
  const Eigen::MatrixXd gain = inverse(r + b.transpose() * *x * b) * b.transpose() * *x * a;
  const Eigen::MatrixXd again = a.transpose() * *x * (a - b * gain) + q;
  EXPECT_LT((again - *x).norm(), 1e-11 * x->norm());
  EXPECT_LT(eigenvalues(a - b * gain).cwiseAbs().maxCoeff(), 1.0);
}

TEST(Riccati, NothingWhereNothingStabilises) {
  EXPECT_FALSE(solve_riccati(scalar(1.5), scalar(0.0), scalar(1.0), scalar(1.0)));
}

}  // namespace
}  // namespace resonid::linalg
