// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <loosening_belt.hpp>
#include <random>

namespace resonid {
namespace {

using online::ChangeDetector;

/// One false alarm in 1000 h, blocks of half a second: 10 of them in 10 000 h of independent normal blocks,
/// each of which goes through the whole detector. Poisson: 2 ... 20 with probability 0.998. Every baseline is
/// new.
TEST(ChangeStatistics, OneFalseAlarmInAThousandHours) {
  online::ChangeDetectorConfig config = test::belt_detector(600.0, 3.6e6);
  config.sample_rate_hz = 2.0;  // a value is a block
  auto detector = *ChangeDetector<double>::create(config);
  std::mt19937_64 random(2024);
  std::normal_distribution<double> normal;
  int alarms = 0;
  std::uint64_t watched = 0;
  constexpr std::uint64_t kHours = 10000;
  while (watched < kHours * 7200) {
    watched += detector.ready() ? 1 : 0;
    detector.step(normal(random));
    if (!detector.alarm()) continue;
    ++alarms;
    detector.relearn();
  }
  std::cout << "false alarms in 10 000 h: " << alarms << "\n";
  EXPECT_GE(alarms, 2);
  EXPECT_LE(alarms, 20);
}

/// Of the tracked drive itself, whose estimates are correlated and not quite normal: a rate that can be
/// counted.
TEST(ChangeStatistics, FalseAlarmsOfATrackedDriveComeAsStated) {
  constexpr double kInterval = 100.0;
  double watched = 0.0;
  int alarms = 0;
  for (std::uint64_t seed = 1; seed <= 8; ++seed) {
    const auto record = test::simulated(test::watched_belt(1500.0, seed)).record;
    auto tracker = test::belt_tracker();
    auto detector = *ChangeDetector<double>::create(test::belt_detector(200.0, kInterval));
    for (std::size_t k = 0; k < record.samples(); ++k) {
      tracker->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);
      if (k < 5000) continue;
      watched += detector.ready() ? 0.002 : 0.0;
      detector.step(tracker->resonance_hz());
      if (!detector.alarm()) continue;
      ++alarms;
      detector.relearn();
    }
  }
  std::cout << "false alarms of the tracked drive: " << alarms << " in " << watched << " s, stated "
            << watched / kInterval << "\n";
  EXPECT_LE(alarms, 1.3 * watched / kInterval);
  EXPECT_GE(alarms, 0.2 * watched / kInterval);
}

TEST(ChangeStatistics, FivePercentOfStiffnessAreFoundInTime) {
  constexpr double kBegins = 150.0, kEnds = 160.0;
  std::vector<double> late;
  for (std::uint64_t seed = 101; seed <= 140; ++seed) {
    auto config = test::watched_belt(kEnds + 5.0, seed);
    config.disturbance.loosening = 0.05;
    config.disturbance.loosening_at_s = kBegins;
    config.disturbance.loosening_over_s = kEnds - kBegins;
    const auto record = test::simulated(config).record;
    auto tracker = test::belt_tracker();
    auto detector = *ChangeDetector<double>::create(test::belt_detector(120.0, 3.6e6));
    for (std::size_t k = 0; k < record.samples(); ++k) {
      tracker->step(record.excitation.samples[k], record.input.samples[k], record.output.samples[k]);
      if (k >= 5000) detector.step(tracker->resonance_hz());
    }
    ASSERT_TRUE(detector.alarm()) << seed;
    late.push_back(10.0 + detector.change().detected_s - kEnds);
  }
  std::sort(late.begin(), late.end());
  std::cout << "detected after the end of the change, s: " << late.front() << " ... " << late[late.size() / 2]
            << " ... " << late.back() << "\n";
  EXPECT_GT(late.front(), kBegins - kEnds);
  EXPECT_LT(late.back(), 3.0);
}

}  // namespace
}  // namespace resonid
