// SPDX-License-Identifier: MIT
// The recursive estimators on the tooth belt of Publications II and III, moving and at rest.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "tooth_belt_runs.hpp"

namespace resonid::online {
namespace {

constexpr int kSeeds = 4;

TEST(ToothBelt, TheResonanceIsFollowedAtTheDescribedTime) {
  std::array<test::Deviation, 4> deviation;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto run = test::moving_tooth_belt(static_cast<std::uint64_t>(seed), 250.0);
    deviation[0].add(test::follow(test::arx(run), run));
    deviation[1].add(test::follow(test::output_error(run, OutputErrorGradient::regressor), run));
    deviation[2].add(test::follow(test::closed_loop(run, ClosedLoopGradient::regressor), run));
    deviation[3].add(test::follow(test::closed_loop(run, ClosedLoopGradient::damped_filter), run));
  }
  EXPECT_LT(deviation[0].rms_percent(), 0.50);
  EXPECT_LT(deviation[1].rms_percent(), 0.40);
  EXPECT_LT(deviation[2].rms_percent(), 0.75);
  EXPECT_LT(deviation[3].rms_percent(), 0.32);
  EXPECT_LT(deviation[3].most_percent(), 2.0);
}

TEST(ToothBelt, FastSamplingIsReportedAndMended) {
  const auto run = test::moving_tooth_belt(11, 500.0);
  auto plain = test::closed_loop(run, ClosedLoopGradient::regressor);
  auto damped = test::closed_loop(run, ClosedLoopGradient::damped_filter);
  EXPECT_GT(test::follow(plain, run).rms_percent(), 10.0);
  const auto followed = test::follow(damped, run);
  EXPECT_LT(followed.rms_percent(), 0.30);
  EXPECT_LT(followed.most_percent(), 2.0);
  // Asked at the machine's own model, which is the last good estimate of the second.
  for (std::size_t k = 0; k < run.y.size(); ++k) damped.step(run.ru[k], run.u[k], run.y[k]);
  EXPECT_TRUE(damped.locally_stable());
  ClosedLoopOutputErrorConfig c = test::closed_loop_config(run);
  const auto model = damped.model();
  c.common.start_b = model.b;
  c.common.start_a = model.a;
  EXPECT_FALSE((ClosedLoopOutputError<double, 3>::create(c).value().locally_stable()));
}

TEST(ToothBelt, AReferenceIsAsGoodAsRemovedEitherWay) {
  const auto run = test::moving_tooth_belt(12, 250.0);
  auto c = test::closed_loop_config(run);
  c.gradient = ClosedLoopGradient::damped_filter;
  c.input = PredictorInput::excitation;
  c.common.high_pass_hz = 1.0;
  EXPECT_LT(test::follow(ClosedLoopOutputError<double, 3>::create(c).value(), run).rms_percent(), 0.30);
  c.common.high_pass_hz = 0.0;  // the predictor does not know what moves the machine
  EXPECT_GT(test::follow(ClosedLoopOutputError<double, 3>::create(c).value(), run).rms_percent(), 0.40);
}

TEST(ToothBelt, WithoutExcitationTheEstimateIsHeld) {
  const auto run = test::constant_tooth_belt(13, 0.1, 1.0, 20.0);
  auto c = test::closed_loop_config(run);
  c.gradient = ClosedLoopGradient::damped_filter;
  auto estimator = ClosedLoopOutputError<double, 3>::create(c).value();
  const std::size_t half = run.y.size() / 2;
  for (std::size_t k = 0; k < half; ++k) estimator.step(run.ru[k], run.u[k], run.y[k]);
  EXPECT_TRUE(estimator.ready());
  const auto before = estimator.model();
  // The excitation ends; what is left is noise.
  for (std::size_t k = half; k < run.y.size(); ++k) estimator.step(0.0, 0.01 * run.u[k], 0.01 * run.y[k]);
  EXPECT_FALSE(estimator.ready());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(estimator.model().a[i], before.a[i], 0.15);
  EXPECT_EQ(estimator.skipped_samples(), 0U);
}

TEST(ToothBelt, ClosedLoopErrorIsUnbiasedWhereArxIsNot) {
  test::NormalizedError arx, damped;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto run = test::constant_tooth_belt(static_cast<std::uint64_t>(seed), 1.0, 3.0, 18.0);
    arx.add(test::last_resonance(test::arx(run, Forgetting::none), run), run.resonance_hz.back());
    damped.add(test::last_resonance(
                   test::closed_loop(run, ClosedLoopGradient::damped_filter, Forgetting::none), run),
               run.resonance_hz.back());
  }
  EXPECT_GT(arx.rms(), 3.0);
  EXPECT_LT(damped.rms(), 2.0);
}

}  // namespace
}  // namespace resonid::online
