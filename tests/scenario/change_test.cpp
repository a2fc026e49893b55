// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <loosening_belt.hpp>

namespace resonid {
namespace {

using online::ChangeStatistic;

constexpr double kSettle = 10.0, kBaseline = 120.0, kBegins = 150.0, kTakes = 10.0;
constexpr double kThousandHours = 3.6e6;

TEST(ChangeDetection, FindsFivePercentOfStiffnessLostAtOneFalseAlarmInAThousandHours) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto config = test::watched_belt(kBegins + kTakes + 5.0, seed);
    config.disturbance.loosening = 0.05;
    config.disturbance.loosening_at_s = kBegins;
    config.disturbance.loosening_over_s = kTakes;
    const auto simulation = test::simulated(config);
    const auto& record = simulation.record;
    auto tracker = test::belt_tracker();
    auto settings = test::belt_detector(kBaseline, kThousandHours);
    auto ratio = *online::ChangeDetector<double>::create(settings);
    settings.statistic = ChangeStatistic::cusum;
    auto cusum = *online::ChangeDetector<double>::create(settings);
    for (std::size_t k = 0; k < record.samples(); ++k) {
      tracker->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);
      if (static_cast<double>(k) < kSettle * record.sample_rate_hz) continue;
      ratio.step(tracker->resonance_hz());
      cusum.step(tracker->resonance_hz());
    }
    for (const auto* detector : {&ratio, &cusum}) {
      ASSERT_TRUE(detector->alarm()) << seed;
      const auto change = detector->change();
      EXPECT_GT(kSettle + change.detected_s, kBegins) << seed;
      EXPECT_LT(kSettle + change.detected_s, kBegins + kTakes + 3.0) << seed;
      EXPECT_NEAR(kSettle + change.time_s, kBegins, kTakes) << seed;
      // The whole change is 2.5 % of 15.09 Hz, the mean since it began less.
      EXPECT_LT(change.size, -5.0 * change.size_std) << seed;
      EXPECT_GT(change.size, -0.39) << seed;
    }
  }
}

}  // namespace
}  // namespace resonid
