// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <planned_experiment.hpp>
#include <resonid/planning/detail/power_distribution.hpp>

namespace resonid::planning {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

// D-optimal for a quadratic on [-1, 1]: a third of the weight at -1, 0 and 1 (Fedorov 1972).
TEST(PowerDistribution, OfAQuadraticIsTheKnownOne) {
  constexpr int kPoints = 9;
  DesignModel model{Eigen::MatrixXcd(3, kPoints), MatrixXd::Zero(0, 3)};
  for (int i = 0; i < kPoints; ++i) {
    const double x = -1.0 + 2.0 * i / (kPoints - 1);
    model.sensitivity.col(i) << 1.0, x, x * x;
  }
  DesignProblem problem{{model}, MatrixXd::Ones(1, kPoints), Criterion::d};
  const auto d = distribute_power(problem);
  for (const int i : {0, 4, 8}) EXPECT_NEAR(d.power(i), 1.0 / 3.0, 0.02);
  EXPECT_NEAR(d.power.sum(), 1.0, 1e-12);
  EXPECT_LT(d.gap, 3e-3);
  // A-optimal: 1/4, 1/2, 1/4.
  problem.criterion = Criterion::a;
  const auto a = distribute_power(problem);
  EXPECT_NEAR(a.power(0), 0.25, 0.02);
  EXPECT_NEAR(a.power(4), 0.5, 0.03);
}

DesignProblem of_the_drive(Criterion criterion) {
  const auto drive = test::rough_drive({1.0, 1.0, 1.0, 1.0}, 0.1);
  std::vector<double> lines;
  for (int i = 1; i < 40; ++i) lines.push_back(0.75 * i);
  DesignProblem p;
  p.criterion = criterion;
  p.models = {{line_sensitivities(drive, lines), MatrixXd::Identity(4, 4) / 0.01}};
  const auto loop = loop_response(drive, lines);
  p.use.resize(2, static_cast<Eigen::Index>(lines.size()));
  for (std::size_t k = 0; k < lines.size(); ++k) {
    p.use(0, static_cast<Eigen::Index>(k)) = 2.0;
    p.use(1, static_cast<Eigen::Index>(k)) = 4.0 * std::norm(loop.velocity[k]);
  }
  return p;
}

double worst_variance(const DesignProblem& p, const VectorXd& power) {
  const auto& d = p.models[0].sensitivity;
  const MatrixXd information = (d * power.asDiagonal() * d.adjoint()).real();
  return information.ldlt().solve(MatrixXd::Identity(4, 4)).diagonal().maxCoeff();
}

// Convex: no small exchange of power between lines within the limits may do better.
TEST(PowerDistribution, CannotBeBetteredByExchangingPower) {
  const auto p = of_the_drive(Criterion::accuracy);
  const auto best = distribute_power(p);
  EXPECT_LE((p.use * best.power).maxCoeff(), 1.0 + 1e-12);
  const double value = worst_variance(p, best.power);
  for (Eigen::Index k = 0; k < best.power.size(); ++k) {
    VectorXd other = 0.98 * best.power;
    other(k) += 0.02 / p.use.col(k).maxCoeff();
    other /= (p.use * other).maxCoeff();
    EXPECT_GT(worst_variance(p, other), value * (1.0 - 0.003)) << k;
  }
}

TEST(PowerDistribution, BeatsAFlatSpectrum) {
  for (const auto criterion : {Criterion::accuracy, Criterion::d, Criterion::a, Criterion::e}) {
    const auto p = of_the_drive(criterion);
    const auto best = distribute_power(p);
    VectorXd flat = VectorXd::Ones(best.power.size());
    flat /= (p.use * flat).maxCoeff();
    EXPECT_LT(worst_variance(p, best.power), 0.7 * worst_variance(p, flat)) << static_cast<int>(criterion);
    EXPECT_NEAR(best.used.maxCoeff(), 1.0, 1e-12);
  }
}

}  // namespace
}  // namespace resonid::planning
