// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <planned_experiment.hpp>

namespace resonid {
namespace {

constexpr double kNoise = 0.1;

// From a model that is off by 20 % in everything to the chirp's accuracies in less than half its 17 s, in two
// steps; tests/statistics has the errors over 50 seeds.
TEST(Plan, BeatsThePublishedChirpInHalfTheTime) {
  const auto chirp = test::without_noise(test::published_chirp(kNoise));
  const double torque = test::peak(chirp.record.input.samples);
  const auto by_chirp = test::predicted_errors(chirp.record.excitation.samples, kNoise);
  auto wanted = by_chirp;
  for (double& w : wanted) w *= 0.6;
  const auto two = test::two_stages({1.2, 0.8, 1.2, 0.8}, kNoise, 0.97 * torque, wanted, 1, 1);
  EXPECT_LE(two.time_s, 8.5);
  EXPECT_LE(two.peak_torque, torque);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT(two.predicted[i], by_chirp[i]) << fit::kParameterNames[i];
    EXPECT_LT(two.error[i], 3.5 * two.predicted[i]) << fit::kParameterNames[i];
  }
}

// One run, planned for all that 20 % allow: in half the time every parameter's bar on the true drive is
// narrower than the chirp's. These are the corners that are hardest for J1; tests/statistics has all.
TEST(Plan, BeatsThePublishedChirpInOneRunOfHalfTheTime) {
  const auto chirp = test::without_noise(test::published_chirp(kNoise));
  const double torque = test::peak(chirp.record.input.samples);
  const auto by_chirp = test::predicted_errors(chirp.record.excitation.samples, kNoise);
  for (const auto& factor :
       {std::array{1.2, 1.2, 1.0 / 1.2, 1.0 / 1.2}, std::array{1.0 / 1.2, 1.0 / 1.2, 1.2, 1.2}}) {
    const auto plan = test::planned_for_half_the_time(factor, kNoise, 0.97 * torque, by_chirp);
    const auto& x = plan.planned();
    EXPECT_LE(x.duration_s, 8.5);
    EXPECT_LE(test::peak(test::without_noise(test::planned_experiment(x, kNoise)).record.input.samples),
              torque);
    const auto bars = test::predicted_errors(x.excitation, kNoise);
    for (std::size_t i = 0; i < 4; ++i)
      EXPECT_LT(bars[i], by_chirp[i]) << fit::kParameterNames[i] << ", J1 " << factor[0];
  }
}

}  // namespace
}  // namespace resonid
