// SPDX-License-Identifier: MIT
#include "linalg/decompositions.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace resonid::linalg {
namespace {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Full rank, badly scaled, neither symmetric nor normal.
MatrixXd columns(Eigen::Index rows, Eigen::Index cols) {
  MatrixXd m(rows, cols);
  for (Eigen::Index i = 0; i < rows; ++i)
    for (Eigen::Index j = 0; j < cols; ++j) {
      const auto k = static_cast<double>(i * cols + j);
      m(i, j) = std::sin(1.0 + 2.3 * k + 0.7 * k * k) * std::pow(10.0, static_cast<double>(j - 1));
    }
  return m;
}

TEST(Decompositions, SolveOneRightSideAndSeveral) {
  const MatrixXd a = columns(6, 4), normal = a.transpose() * a;
  const MatrixXd x = columns(4, 2);
  const MatrixXd right = normal * x;
  EXPECT_LT((RealLdlt(normal).solve(right) - x).norm(), 1e-8 * x.norm());
  EXPECT_LT((Llt(normal).solve(right.col(0)) - x.col(0)).norm(), 1e-8 * x.norm());
  EXPECT_LT((RealLu(normal).solve(right) - x).norm(), 1e-8 * x.norm());
  EXPECT_LT((Qr(a).solve(a * x) - x).norm(), 1e-11 * x.norm());
  EXPECT_LT((PivotedQr(a).solve((a * x).col(1)) - x.col(1)).norm(), 1e-11 * x.norm());
  const MatrixXcd c = normal.cast<std::complex<double>>() * std::complex<double>(0.6, 0.8);
  EXPECT_LT((ComplexLu(c).solve(c * x.cast<std::complex<double>>()) - x).norm(), 1e-8 * x.norm());
}

TEST(Decompositions, FactorsMultiplyToTheMatrix) {
  const MatrixXd a = columns(6, 4), normal = a.transpose() * a;
  EXPECT_LT((Qr(a).thin_q() * Qr(a).upper() - a).norm(), 1e-13 * a.norm());
  const MatrixXd lower = Llt(normal).lower();
  EXPECT_LT((lower * lower.transpose() - normal).norm(), 1e-13 * normal.norm());
  MatrixXd in_place = a;
  qr_in_place(in_place);
  for (Eigen::Index i = 0; i < 4; ++i)
    for (Eigen::Index j = i; j < 4; ++j) EXPECT_EQ(in_place(i, j), Qr(a).upper()(i, j));
  EXPECT_LT((solve_upper(upper_factor(a), Qr(a).upper()) - MatrixXd::Identity(4, 4)).norm(), 1e-13);
  EXPECT_LT((solve_lower(lower, lower) - MatrixXd::Identity(4, 4)).norm(), 1e-13);
  EXPECT_LT((inverse(normal) * normal - MatrixXd::Identity(4, 4)).norm(), 1e-6);
}

TEST(Decompositions, TellWhatIsNotThere) {
  MatrixXd a = columns(6, 3);
  EXPECT_EQ(PivotedQr(a).rank(), 3);
  a.col(2) = a.col(0) - 2.0 * a.col(1);
  EXPECT_EQ(PivotedQr(a).rank(), 2);
  EXPECT_EQ(PivotedQr(a).rank(0.999), 1);
  EXPECT_EQ(pseudo_inverse(a).rank, 2);
  const MatrixXd p = pseudo_inverse(a).matrix;
  EXPECT_LT((a * p * a - a).norm(), 1e-12 * a.norm());
  const VectorXd x = shortest_solution(a, a.col(0));
  EXPECT_LT((a * x - a.col(0)).norm(), 1e-12 * a.norm());
  EXPECT_LT(x.norm(), 1.0);  // that of (1, 0, 0)
  EXPECT_FALSE(Llt(-MatrixXd::Identity(2, 2)).succeeded());
  EXPECT_LT(RealLdlt(a.transpose() * a).rcond(), 1e-12);
  EXPECT_GT(ComplexLu(MatrixXcd::Identity(3, 3)).rcond(), 0.99);
}

TEST(Decompositions, EigenpairsAreThoseOfTheMatrix) {
  MatrixXd turn(3, 3);
  turn << 0.0, -2.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 5.0;  // +-2j and 5
  const auto [values, vectors] = eigenpairs(turn);
  EXPECT_LT((turn * vectors - vectors * values.asDiagonal()).norm(), 1e-13);
  EXPECT_NEAR(eigenvalues(turn).cwiseAbs().minCoeff(), 2.0, 1e-14);
  EXPECT_NEAR(eigenvalues(turn).cwiseAbs().maxCoeff(), 5.0, 1e-14);
  MatrixXd symmetric(2, 2);
  symmetric << 2.0, 99.0, 1.0, 2.0;  // the upper triangle is not read
  const auto pairs = symmetric_eigenpairs(symmetric);
  EXPECT_NEAR(pairs.values(0), 1.0, 1e-14);
  EXPECT_NEAR(pairs.values(1), 3.0, 1e-14);
  EXPECT_LT((pairs.vectors.transpose() * pairs.vectors - MatrixXd::Identity(2, 2)).norm(), 1e-14);
}

}  // namespace
}  // namespace resonid::linalg
