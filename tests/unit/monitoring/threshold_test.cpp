// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <monitoring/threshold.hpp>
#include <random>
#include <resonid/online/supervision/change_detection.hpp>
#include <vector>

namespace resonid::monitoring {
namespace {

TEST(Threshold, IsDividedOverFiguresAndAxes) {
  const double each = detector_interval_s(3.6e6, 100 * 11).value();
  EXPECT_DOUBLE_EQ(each, 3.6e6 * 1100.0);
  const std::vector<Detectors> axes(100, {11, each});
  EXPECT_NEAR(installation_interval_s(axes), 3.6e6, 1.0);
}

TEST(Threshold, AxesThatComeOrGoCountUntilTheOthersLearnAnew) {
  constexpr double kAsked = 3.6e6;
  // Ten axes learned together, ten come later and learn with what twenty need.
  const Detectors old{110, detector_interval_s(kAsked, 110).value()};
  const Detectors come{110, detector_interval_s(kAsked, 220).value()};
  EXPECT_NEAR(installation_interval_s(std::array{old, come}), kAsked / 1.5, 1.0);
  const Detectors relearned{110, detector_interval_s(kAsked, 220).value()};
  EXPECT_NEAR(installation_interval_s(std::array{relearned, come}), kAsked, 1.0);
  // Ten go again.
  EXPECT_NEAR(installation_interval_s(std::array{relearned}), 2.0 * kAsked, 1.0);
  EXPECT_EQ(installation_interval_s({}), std::numeric_limits<double>::infinity());
  EXPECT_EQ(installation_interval_s(std::array{Detectors{}}), std::numeric_limits<double>::infinity());
}

TEST(Threshold, RefusesWhatIsNone) {
  for (const double bad : {0.0, -1.0, std::nan(""), std::numeric_limits<double>::infinity()})
    EXPECT_EQ(detector_interval_s(bad, 3).error().field.view(), "false_alarm_interval_s");
  EXPECT_EQ(detector_interval_s(1.0, 0).error().field.view(), "detectors");
}

/// False alarms of six detectors over a time in which one is due every 2000 blocks; `shared` is the
/// correlation of what they watch.
double alarms_over_due(double shared, unsigned seed) {
  constexpr std::size_t kDetectors = 6;
  constexpr double kAsked = 2000.0;
  constexpr int kBlocks = 400000;
  online::ChangeDetectorConfig config;
  config.sample_rate_hz = config.block_s = 1.0;
  config.baseline_s = 2000.0;
  config.false_alarm_interval_s = detector_interval_s(kAsked, kDetectors).value();
  const auto fresh = online::ChangeDetector<double, 64>::create(config).value();
  std::vector<online::ChangeDetector<double, 64>> detectors(kDetectors, fresh);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  double watched = 0.0;
  int alarms = 0;
  for (int k = 0; k < kBlocks; ++k) {
    const double common = std::sqrt(shared) * normal(random);
    for (auto& d : detectors) {
      d.step(common + std::sqrt(1.0 - shared) * normal(random));
      watched += d.ready() ? 1.0 / kDetectors : 0.0;
      if (!d.alarm()) continue;
      ++alarms;
      d.relearn();
    }
  }
  return alarms / (watched / kAsked);
}

TEST(Threshold, IsTheRateThatDetectorsHaveTogether) {
  const double independent = alarms_over_due(0.0, 1);
  EXPECT_GT(independent, 0.6);
  EXPECT_LT(independent, 1.3);
  const double dependent = alarms_over_due(0.8, 2);
  EXPECT_GT(dependent, 0.4);
  EXPECT_LT(dependent, 1.3);
}

}  // namespace
}  // namespace resonid::monitoring
