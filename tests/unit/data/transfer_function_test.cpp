// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/discrete_filter.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/transfer_function.hpp>
#include <vector>

#include "data/pole_at_one.hpp"

namespace resonid::data {
namespace {

TEST(TransferFunction, PiControllerMatchesItsFormula) {
  const auto c = pi_controller(1.036, 0.147, 0.002);
  const auto z = std::polar(1.0, kTwoPi * 2.7 * 0.002);
  const auto expected = 1.036 * (1.0 + 0.002 / 0.147 * z / (z - 1.0));
  EXPECT_LT(std::abs(c.response(2.7) - expected), 1e-14);
}

/// Against products of factors whose poles are known: biquads of 2 Hz, whose denominator at z = 1 is as small
/// as what rounding leaves elsewhere.
TEST(TransferFunction, KnowsAnIntegratorFromSlowFilters) {
  using Polynomial = std::vector<double>;
  const auto product = [](const Polynomial& p, const Polynomial& q) {
    Polynomial both(p.size() + q.size() - 1, 0.0);
    for (std::size_t i = 0; i < p.size(); ++i)
      for (std::size_t j = 0; j < q.size(); ++j) both[i + j] += p[i] * q[j];
    return both;
  };
  const auto biquad = [](double frequency_hz, double damping, double rate_hz) {
    const double w = kTwoPi * frequency_hz, k = w / std::tan(0.5 * w / rate_hz);
    const double first = k * k + 2.0 * damping * w * k + w * w;
    return Polynomial{1.0, 2.0 * (w * w - k * k) / first, (k * k - 2.0 * damping * w * k + w * w) / first};
  };
  const auto integrates = [](const Polynomial& denominator) {
    return has_pole_at_one({{1.0}, denominator, 0.002});
  };
  const Polynomial once = {1.0, -1.0};
  for (const double rate_hz : {500.0, 2000.0, 8000.0})
    for (const double damping : {0.1, 0.7, 0.95}) {
      SCOPED_TRACE(rate_hz);
      const auto one = biquad(2.0, damping, rate_hz), two = product(one, one);
      EXPECT_FALSE(integrates(one));
      EXPECT_FALSE(integrates(two));
      EXPECT_TRUE(integrates(product(once, one)));
      EXPECT_TRUE(integrates(product(once, two)));
      EXPECT_TRUE(integrates(product(product(once, once), two)));
      EXPECT_FALSE(integrates(product({1.0, -0.5}, two)));
    }
  EXPECT_FALSE(integrates({1.0}));
  EXPECT_TRUE(integrates(once));
  EXPECT_FALSE(integrates({1.0, -0.999}));
  // Two of them, of nine digits and of all.
  const auto rounded = [](Polynomial p) {
    for (double& term : p) term = std::round(1e9 * term) / 1e9;
    return p;
  };
  EXPECT_TRUE(integrates(rounded(product(product(once, once), {1.0, -0.654321987, 0.123456789}))));
  const auto poles =
      TransferFunction{{1.0}, product(product(once, once), biquad(100.0, 0.7, 10000.0)), 1e-4}.poles();
  EXPECT_EQ(std::ranges::count(poles, std::complex<double>(1.0)), 2);
  for (const auto& pole : poles) EXPECT_LE(std::abs(pole), 1.0);
  // Of nine digits; beside it no filter that is slower than what they leave.
  EXPECT_TRUE(integrates({1.0, -1.500000001, 0.5}));
  EXPECT_TRUE(integrates(product(biquad(20.0, 0.7, 500.0), {1.0, -0.999999999})));
}

TEST(TransferFunction, SimulationResponseAndFilterAgree) {
  const TransferFunction g{{0.0, 0.2, 0.1}, {1.0, -1.6, 0.81}, 0.01};
  std::vector<double> impulse(4000, 0.0);
  impulse[0] = 1.0;
  const auto h = g.simulate(impulse);
  auto run = DiscreteFilter<double, 3>::create(g.numerator, g.denominator);
  ASSERT_TRUE(run.has_value());
  std::complex<double> sum = 0.0;
  for (std::size_t k = 0; k < h.size(); ++k) {
    EXPECT_NEAR(run->step(impulse[k]), h[k], 1e-12);
    sum += h[k] * std::polar(1.0, -kTwoPi * 7.0 * 0.01 * static_cast<double>(k));
  }
  EXPECT_LT(std::abs(sum - g.response(7.0)), 1e-10);
}

TEST(TransferFunction, PolesOfAnOscillator) {
  const TransferFunction g{{0.0, 1.0}, {1.0, -2.0 * 0.9 * std::cos(0.5), 0.81}, 0.01};
  const auto poles = g.poles();
  ASSERT_EQ(poles.size(), 2U);
  EXPECT_NEAR(std::abs(poles[0]), 0.9, 1e-12);
  EXPECT_NEAR(std::abs(std::arg(poles[0])), 0.5, 1e-12);
}

TEST(DiscreteFilter, SettlesInASteadyState) {
  auto c = DiscreteFilter<double, 2>::create(std::vector{1.0, -0.9}, std::vector{1.0, -1.0});
  ASSERT_TRUE(c.has_value());
  c->settle(0.0, 3.0);
  EXPECT_DOUBLE_EQ(c->step(0.0), 3.0);
  EXPECT_DOUBLE_EQ(c->step(0.0), 3.0);
}

TEST(DiscreteFilter, RefusesAZeroLeadingCoefficient) {
  const auto refused = DiscreteFilter<double, 2>::create(std::vector{1.0}, std::vector{0.0, 1.0});
  ASSERT_FALSE(refused.has_value());
  EXPECT_EQ(refused.error().field, "denominator");
}

TEST(FrequencyResponse, InterpolatesAndCutsBands) {
  const FrequencyResponse g{{1.0, 2.0, 4.0}, {{1, 0}, {3, 2}, {5, 4}}, {0.1, 0.2, 0.3}, {}, {4.0}};
  EXPECT_EQ(g.at(3.0), std::complex<double>(4.0, 3.0));
  EXPECT_EQ(g.at(0.5), std::complex<double>(1.0, 0.0));
  const auto part = g.band(1.5, 3.0);
  ASSERT_EQ(part.lines(), 1U);
  EXPECT_EQ(part.std[0], 0.2);
  EXPECT_TRUE(part.unsettled_hz.empty());
}

TEST(FrequencyResponse, ConfidenceRadiusOfACircularError) {
  EXPECT_NEAR(confidence_radius(1.0, 0.95), std::sqrt(-std::log(0.05)), 1e-15);
}

}  // namespace
}  // namespace resonid::data
