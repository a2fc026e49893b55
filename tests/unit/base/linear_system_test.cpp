// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <golden.hpp>
#include <resonid/base/detail/linear_system.hpp>

namespace resonid {
namespace {

template <int Order>
using Matrix = Eigen::Matrix<double, Order, Order>;

template <int Order>
double norm(const Matrix<Order>& a) {
  return a.cwiseAbs().rowwise().sum().maxCoeff();
}

template <int Order>
void expect_near(const Matrix<Order>& found, const Matrix<Order>& expected, double relative) {
  EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), relative * expected.cwiseAbs().maxCoeff()) << found;
}

// Expected values: scipy 1.10.1, scipy.linalg.expm(a).
TEST(MatrixExponential, IsThatOfScipy) {
  Matrix<3> a, e;
  a << -1.0, 2.0, 0.5, 0.25, -3.0, 1.0, 0.0, 4.0, -2.0;
  e << 0.4548580220368126, 0.7410357862973838, 0.3850655865024176, 0.067653643296164, 0.31324215552364365,
      0.1831991682161248, 0.09990331996403576, 0.6828450128824811, 0.4340017487622462;
  expect_near<3>(matrix_exponential<double, 3>(a, norm<3>(a)), e, 1e-14);
}

/// A number with three derivatives, as automatic differentiation has.
struct Dual {
  enum { DIMENSION = 3 };  // NOLINT(readability-identifier-naming): as ceres::Jet says it
  Dual() = default;
  explicit Dual(double value) : a(value) {}
  [[nodiscard]] double v(int p) const { return by[static_cast<std::size_t>(p)]; }
  double& v(int p) { return by[static_cast<std::size_t>(p)]; }
  double a = 0.0;
  std::array<double, 3> by{};
};

/// exp([-d w; -w -d]) = e^-d [cos w, sin w; -sin w, cos w].
TEST(MatrixExponential, HasTheDerivativesOfADampedRotation) {
  for (const double w : {0.3, 2.0, 40.0}) {
    const double d = 0.1 * w;
    Eigen::Matrix<Dual, 2, 2> a;
    a(0, 0) = a(1, 1) = Dual(-d);
    a(0, 1) = Dual(w);
    a(1, 0) = Dual(-w);
    a(0, 0).v(0) = a(1, 1).v(0) = -1.0;  // by d; nothing by the second
    a(0, 1).v(2) = 1.0;                  // by w
    a(1, 0).v(2) = -1.0;
    const auto e = matrix_exponential<Dual, 2>(a, d + w);
    const double size = std::exp(-d), c = size * std::cos(w), s = size * std::sin(w);
    const double near = 1e-13 * size * std::max(1.0, w);
    const std::array<double, 4> value{c, s, -s, c}, by_w{-s, c, -c, -s};
    for (int i = 0; i < 4; ++i) {
      const Dual& found = e(i / 2, i % 2);
      const auto k = static_cast<std::size_t>(i);
      EXPECT_NEAR(found.a, value[k], near);
      EXPECT_NEAR(found.v(0), -value[k], near);
      EXPECT_EQ(found.v(1), 0.0);
      EXPECT_NEAR(found.v(2), by_w[k], near);
    }
  }
}

TEST(MatrixExponential, KeepsItsDigitsAtLargeNorms) {
  Matrix<2> a, e;
  a << 0.0, 300.0, -300.0, -20.0;
  e << -1.0008446138490363e-05, -4.461787762018555e-05, 4.461787762018555e-05, -7.033920963811327e-06;
  expect_near<2>(matrix_exponential<double, 2>(a, norm<2>(a)), e, 1e-12);
  a << -250.0, 200.0, 10.0, -400.0;
  e << 5.5674216345161686e-104, 6.85975714491975e-104, 3.429878572459875e-105, 4.226037758263565e-105;
  expect_near<2>(matrix_exponential<double, 2>(a, norm<2>(a)), e, 1e-11);
}

TEST(MatrixExponential, OfNothingIsOne) {
  Matrix<2> a = Matrix<2>::Zero();
  EXPECT_EQ((matrix_exponential<double, 2>(a, 0.0)), (Matrix<2>::Identity()));
  a << 1e-9, 2e-9, -3e-9, 4e-9;
  const auto e = matrix_exponential<double, 2>(a, norm<2>(a));
  EXPECT_DOUBLE_EQ(e(0, 1), 2.000000005e-09);
  EXPECT_DOUBLE_EQ(e(1, 0), -3.0000000075e-09);
}

/// A bound far above the norm costs squarings, and so a few digits, but not the result.
TEST(MatrixExponential, AGenerousBoundDoesNoHarm) {
  Matrix<2> a;
  a << -1.0, 0.5, 0.25, -2.0;
  expect_near<2>(matrix_exponential<double, 2>(a, 1000.0), matrix_exponential<double, 2>(a, norm<2>(a)),
                 1e-12);
}

TEST(MatrixExponential, InFloat) {
  Eigen::Matrix2f a;
  a << -1.0F, 2.0F, 0.25F, -3.0F;
  Matrix<2> wide = a.cast<double>();
  const auto found = matrix_exponential<float, 2>(a, norm<2>(wide));
  expect_near<2>(found.cast<double>(), matrix_exponential<double, 2>(wide, norm<2>(wide)), 1e-6);
}

// Expected values: scipy.signal.cont2discrete((a, b, c, d), 0.01, 'zoh') of the same matrices.
TEST(ZeroOrderHold, IsThatOfScipy) {
  LinearSystem<double, 2> s;
  s.a << 0.0, 1.0, -400.0, -2.0;
  s.b << 0.0, 400.0;
  s.c << 1.0, 0.0;
  s.d = 0.25;
  const auto d = zero_order_hold(s, 0.01);
  Matrix<2> a;
  a << 0.9801987172464657, 0.009834791246272739, -3.933916498509095, 0.9605291347539202;
  expect_near<2>(d.a, a, 1e-14);
  EXPECT_NEAR(d.b(0), 0.019801282753534325, 1e-15);
  EXPECT_NEAR(d.b(1), 3.933916498509095, 1e-13);
  EXPECT_EQ(d.c, s.c);
  EXPECT_EQ(d.d, 0.25);
}

/// Belt of Nevaranta 2016, eqs. 2.1-2.3, in the golden file's state: velocities of the rollers, elongation of
/// the belt.
LinearSystem<double, 3> belt(const nlohmann::json& golden) {
  constexpr double kRadius = 0.05;
  const auto& p = golden.at("params");
  const double j1 = p.at("J1"), j2 = p.at("J2"), k = p.at("K"), d = p.at("D");
  LinearSystem<double, 3> s;
  const double damping = d * kRadius * kRadius;
  s.a << -damping / j1, damping / j1, -k * kRadius / j1, damping / j2, -damping / j2, k * kRadius / j2,
      kRadius, -kRadius, 0.0;
  const bool first = golden.at("driven_roller") == 1;
  s.b << (first ? 1.0 / j1 : 0.0), (first ? 0.0 : 1.0 / j2), 0.0;
  return s;
}

TEST(ZeroOrderHold, HasTheGoldenMatricesOfTheBelts) {
  const auto models = test::golden_json("models.json");
  for (const char* name : {"belt1", "belt2", "belt3"})
    for (const double step : {0.001, 0.002}) {
      const auto& golden = models.at(name).at(step < 0.0015 ? "Ts=0.001" : "Ts=0.002");
      const auto sampled = zero_order_hold(belt(models.at(name)), step);
      for (int i = 0; i < 3; ++i) {
        const double b = golden.at("Bd")[static_cast<std::size_t>(i)];
        EXPECT_NEAR(sampled.b(i), b, 1e-10 * std::abs(b)) << name << i;
        for (int j = 0; j < 3; ++j) {
          const double a = golden.at("Ad")[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
          EXPECT_NEAR(sampled.a(i, j), a, 1e-10 * std::abs(a)) << name << i << j;
        }
      }
    }
}

TEST(ZeroOrderHold, TwoStepsAreOneOfTwiceTheLength) {
  const auto s = belt(test::golden_json("models.json").at("belt3"));
  const auto once = zero_order_hold(s, 0.001);
  const auto twice = zero_order_hold(s, 0.002);
  expect_near<3>(once.a * once.a, twice.a, 1e-13);
  EXPECT_LT((once.a * once.b + once.b - twice.b).norm(), 1e-13 * twice.b.norm());
}

}  // namespace
}  // namespace resonid
