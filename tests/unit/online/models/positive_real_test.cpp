// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/data/transfer_function.hpp>
#include <resonid/online/models/positive_real.hpp>
#include <tooth_belt.hpp>

#include "allocation_counter.hpp"

namespace resonid::online {
namespace {

PseudoLinearRecursion<3> recursion(double place_m, double sample_time_s, double quality, bool closed_loop) {
  PseudoLinearRecursion<3> r;
  r.model = test::tooth_belt(place_m, sample_time_s, quality);
  r.delay_samples = 1;
  r.controller = test::tooth_belt_controller(sample_time_s);
  r.error = closed_loop ? RegressorFilter::sensitivity : RegressorFilter::inverse_a;
  return r;
}

// Local stability of the pseudolinear recursions by an independent implementation (tests/golden/README.md):
// averages over a PRBS record there, the integral over its spectrum here.
TEST(PositiveReal, ReproducesTheTableOfTheToothBelt) {
  struct Row {
    double sample_time_s, quality;
    std::array<double, 3> open, closed;
  };
  const std::array<Row, 8> table{{{0.0005, 10, {-170.87, -450.83, -657.16}, {-149.12, -401.29, -577.59}},
                                  {0.001, 10, {-17.67, -55.24, -83.49}, {-13.19, -44.41, -65.78}},
                                  {0.002, 10, {-0.13, -6.35, -8.61}, {0.69, -3.08, -5.11}},
                                  {0.002, 5, {0.14, -3.13, -4.87}, {0.62, -1.44, -2.59}},
                                  {0.002, 3, {0.15, -1.88, -3.19}, {0.58, -0.56, -1.28}},
                                  {0.004, 10, {0.51, 0.61, 0.45}, {0.97, 0.83, 0.85}},
                                  {0.004, 5, {0.54, 0.54, 0.40}, {0.93, 0.81, 0.81}},
                                  {0.004, 3, {0.57, 0.48, 0.36}, {0.93, 0.77, 0.75}}}};
  constexpr std::array<double, 3> kPlaces{0.38, 1.0, 1.65};
  for (const Row& row : table)
    for (std::size_t i = 0; i < 3; ++i) {
      const auto open = local_stability(recursion(kPlaces[i], row.sample_time_s, row.quality, false));
      const auto closed = local_stability(recursion(kPlaces[i], row.sample_time_s, row.quality, true));
      EXPECT_NEAR(open.least_eigenvalue, row.open[i], 0.06 + 0.13 * std::abs(row.open[i]))
          << row.sample_time_s << " " << row.quality << " " << kPlaces[i];
      EXPECT_NEAR(closed.least_eigenvalue, row.closed[i], 0.06 + 0.13 * std::abs(row.closed[i]))
          << row.sample_time_s << " " << row.quality << " " << kPlaces[i];
      EXPECT_EQ(open.stable, row.open[i] > 0.0);
      EXPECT_EQ(closed.stable, row.closed[i] > 0.0);
    }
}

TEST(PositiveReal, IsTheIdentityWhereTheGradientIsRight) {
  for (const bool fixed : {false, true}) {
    auto r = recursion(1.0, 0.002, 10.0, true);
    r.fixed_integrator = fixed;
    r.gradient = RegressorFilter::sensitivity;
    r.gradient_model = r.model;
    const auto found = local_stability(r);
    EXPECT_TRUE(found.stable);
    EXPECT_NEAR(found.least_eigenvalue, 1.0, 1e-4);
    EXPECT_NEAR(found.least_real_part, 0.5, 1e-9);
    EXPECT_NEAR(found.lag_share, 1.0, 1e-4);
  }
}

TEST(PositiveReal, TheFrequencyConditionIsSufficient) {
  int holds = 0, fails = 0;
  for (const double quality : {0.2, 0.3, 0.5, 1.0, 3.0})
    for (const double place : {0.38, 1.0, 1.65}) {
      const auto found = local_stability(recursion(place, 0.004, quality, true));
      (found.least_real_part >= 0.0 ? holds : fails) += 1;
      if (found.least_real_part >= 0.0) {
        EXPECT_TRUE(found.stable) << quality << " " << place;
      }
    }
  EXPECT_GT(fails, 0);
}

TEST(PositiveReal, AFilterNearTheMachineMendsFastSampling) {
  auto r = recursion(1.0, 0.002, 10.0, true);
  EXPECT_FALSE(local_stability(r).stable);
  r.gradient = RegressorFilter::sensitivity;
  r.gradient_model = test::tooth_belt(0.97, 0.002, 10.0);
  EXPECT_TRUE(local_stability(r).stable);
}

TEST(PositiveReal, NeedsNoHeap) {
  const auto r = recursion(1.0, 0.004, 10.0, true);
  const std::size_t before = test::allocations();
  EXPECT_TRUE(local_stability(r).stable);
  EXPECT_EQ(test::allocations(), before);
}

// Output error's M often has parallel eigenvectors: here all of a block's are one.
TEST(PositiveReal, TheCovarianceSolvesItsEquationWithoutEigenvectorsToo) {
  for (const int n : {2, 6, 12}) {
    BoundedMatrix m = BoundedMatrix::Identity(n, n), root = BoundedMatrix::Zero(n, n);
    for (int i = 0; i < n; ++i) {
      if (i > 0) m(i - 1, i) = 2.0;
      for (int j = 0; j < n; ++j) root(i, j) = std::sin(1.0 + 3.0 * i + 7.0 * j * j);
    }
    const BoundedMatrix p = root * root.transpose();
    constexpr double kShare = 1.0 / 1.99;
    const std::size_t before = test::allocations();
    const BoundedMatrix x = recursion_covariance(m, p, kShare);
    EXPECT_EQ(test::allocations(), before);
    const BoundedMatrix moved = m - (1.0 - 0.5 / kShare) * BoundedMatrix::Identity(n, n);
    const BoundedMatrix rest = moved * x + x * moved.transpose() - p;
    EXPECT_LT(rest.cwiseAbs().maxCoeff(), 1e-12 * x.cwiseAbs().maxCoeff()) << n;
    EXPECT_GT(x.diagonal().minCoeff(), 0.0) << n;
  }
}

// The machine at two places differs in stiffness alone, with the same damping ratio.
TEST(PositiveReal, AScaledResonanceIsAChangedStiffness) {
  const auto here = test::tooth_belt(0.8, 0.004, 10.0), there = test::tooth_belt(0.81, 0.004, 10.0);
  const double ratio = SampledModes<3>(there, 250.0).resonances()[0].frequency_hz /
                       SampledModes<3>(here, 250.0).resonances()[0].frequency_hz;
  const auto moved = SampledModes<3>(here, 250.0).with_first_resonance_scaled(ratio);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(moved.a[i], there.a[i], 1e-9);
    EXPECT_NEAR(moved.b[i], there.b[i], 1e-9);
  }
}

}  // namespace
}  // namespace resonid::online
