// SPDX-License-Identifier: MIT
// Detection lines of an odd random multisine: a dry drive shows distortion, a linear one none.
#include <experiments.hpp>

namespace resonid {
namespace {

identification::Result measured(double coulomb_newton_m) {
  auto experiment = test::published_drive(0.001);
  experiment.excitation.kind = excitation::Kind::multisine;
  experiment.excitation.phases = excitation::Phases::random;
  experiment.excitation.amplitude = 0.3;
  std::vector<double> lines;
  for (int k = 3, i = 0; k < 80; k += 2, ++i)
    if (i % 4 != 2) lines.push_back(0.5 * k);
  EXPECT_TRUE(experiment.excitation.lines_hz.assign(lines));
  experiment.run.duration_s = 16.0;  // eight periods of 2 s
  experiment.friction.driven.coulomb = coulomb_newton_m;
  auto options = test::known(experiment);
  options.drop_periods = 2;
  options.method = identification::Method::periodic;
  options.period_samples = 1000;
  return test::identified(test::simulated(experiment).record, options);
}

TEST(NonLinearDistortion, IsFoundWithDryFrictionOnly) {
  EXPECT_EQ(test::finding(measured(0.0), "non-linear-distortion"), nullptr);
  const auto dry = measured(0.2);
  const auto* finding = test::finding(dry, "non-linear-distortion");
  ASSERT_NE(finding, nullptr);
  EXPECT_GT(finding->value.value_or(0.0), 0.01);
  EXPECT_NE(finding->meaning.find("odd"), std::string::npos);
}

}  // namespace
}  // namespace resonid
