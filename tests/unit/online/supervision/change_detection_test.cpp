// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <allocation_counter.hpp>
#include <cmath>
#include <limits>
#include <random>
#include <resonid/online/supervision/change_detection.hpp>
#include <string>
#include <type_traits>

namespace resonid::online {
namespace {

using Detector = ChangeDetector<double>;
static_assert(std::is_trivially_copyable_v<Detector>);
static_assert(std::is_trivially_copyable_v<ChangeDetector<float, 16>>);

class Normal {
 public:
  explicit Normal(std::uint64_t seed) : random_(seed) {}
  double operator()() { return normal_(random_); }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

/// A rate of 1 Hz and blocks of 1 s: a value is a block.
ChangeDetectorConfig by_value(ChangeStatistic statistic, double interval) {
  ChangeDetectorConfig c;
  c.sample_rate_hz = 1.0;
  c.block_s = 1.0;
  c.baseline_s = 30.0;
  c.false_alarm_interval_s = interval;
  c.statistic = statistic;
  return c;
}
constexpr ChangeStatistic kBoth[] = {ChangeStatistic::cusum, ChangeStatistic::likelihood_ratio};

/// Mean run length of a two-sided CUSUM of standard normal values from its Markov chain (Brook and Evans
/// 1972), an account of it that shares nothing with Siegmund's formula. The sides never are above 0 at once,
/// so 1/ARL is twice that of one.
double markov_run_length(double reference, double threshold) {
  constexpr int kStates = 400;
  const double width = 2.0 * threshold / (2.0 * kStates - 1.0);
  const auto below = [](double x) { return 0.5 * std::erfc(-x / std::sqrt(2.0)); };
  Eigen::MatrixXd stay(kStates, kStates);
  for (int i = 0; i < kStates; ++i)
    for (int j = 0; j < kStates; ++j) {
      const double upper = below((j - i + 0.5) * width + reference);
      stay(i, j) = j == 0 ? upper : upper - below((j - i - 0.5) * width + reference);
    }
  const Eigen::VectorXd length = (Eigen::MatrixXd::Identity(kStates, kStates) - stay)
                                     .partialPivLu()
                                     .solve(Eigen::VectorXd::Ones(kStates));
  return 0.5 * length(0);
}

TEST(ChangeStatistics, ThresholdOfTheCusumIsThatOfItsMarkovChain) {
  for (const double reference : {0.25, 0.5, 1.0})
    for (const double run_length : {200.0, 1e4, 1e6})
      EXPECT_NEAR(markov_run_length(reference, cusum_threshold(reference, run_length)) / run_length, 1.0,
                  0.09)
          << reference << " " << run_length;
}

TEST(ChangeStatistics, FalseAlarmsComeAsStated) {
  Normal normal(1);
  constexpr int kAlarms = 400;  // 5 % of the interval
  Cusum cusum(0.5, cusum_threshold(0.5, 500.0));
  LikelihoodRatio<64> ratio(64, likelihood_ratio_threshold(64, 500.0));
  const auto interval = [&](auto& statistic) {
    double values = 0.0;
    for (int alarms = 0; alarms < kAlarms; ++values)
      if (statistic.step(normal()).level >= 1.0) {
        ++alarms;
        statistic.reset();
      }
    return values / kAlarms;
  };
  EXPECT_NEAR(interval(cusum) / 500.0, 1.0, 0.15);
  EXPECT_NEAR(interval(ratio) / 500.0, 1.08, 0.17);
}

TEST(ChangeStatistics, AShortBaselineDoesNotCryWolf) {
  // Level and spread learned from 25 values only: of the largest ratio of 40 more, the share above the
  // threshold for known ones would be several times larger.
  constexpr double kRunLength = 2000.0;
  constexpr int kRuns = 4000;
  const double threshold = likelihood_ratio_threshold(64, kRunLength);
  int careful = 0, careless = 0;
  Normal normal(12);
  for (int run = 0; run < kRuns; ++run) {
    LearnedBaseline baseline;
    double last = 0.0;
    for (int n = 0; n < 25; ++n) baseline.learn(last = normal(), 1.0);
    LikelihoodRatio<64> ratio(64, threshold), plain = ratio;
    bool alarm = false, plain_alarm = false;
    for (int n = 0; n < 40; ++n) {
      const double x = normal();
      const double z = baseline.standardised(x, last, 1.0);
      alarm = ratio.step(z, {baseline.shared(), baseline.degrees()}).level >= 1.0 || alarm;
      plain_alarm = plain.step(z).level >= 1.0 || plain_alarm;
      last = x;
    }
    careful += alarm ? 1 : 0;
    careless += plain_alarm ? 1 : 0;
  }
  EXPECT_LT(careful, 1.6 * kRuns * 40.0 / kRunLength);
  EXPECT_GT(careless, 5.0 * kRuns * 40.0 / kRunLength);
}

TEST(LearnedBaseline, KnowsItsMeanAndCorrelation) {
  Normal normal(3);
  LearnedBaseline baseline;
  double x = 0.0;
  for (int n = 0; n < 20000; ++n) {
    x = 0.6 * x + normal();
    baseline.learn(1000.0 + x, 1.0);
  }
  EXPECT_NEAR(baseline.memory(), 0.6, 0.03);
  EXPECT_NEAR(baseline.innovation_std(), 1.0, 0.02);
  EXPECT_NEAR(baseline.standardised(1000.0, 1001.0, 1.0), -0.6, 0.05);
  EXPECT_NEAR(baseline.mean_std(20000.0), 2.5 / std::sqrt(20000.0), 0.001);
  EXPECT_NEAR(baseline.mean(), 1000.0, 4.0 * baseline.mean_std(20000.0));
}

/// Mean time between false alarms of correlated values, learned anew after each, over the stated one.
double false_alarm_ratio(ChangeStatistic statistic, double baseline_s, double interval_s, int alarms) {
  auto config = by_value(statistic, interval_s);
  config.baseline_s = baseline_s;
  auto detector = *Detector::create(config);
  Normal normal(4);
  double x = 0.0, watching = 0.0;
  for (int found = 0; found < alarms;) {
    x = 0.3 * x + normal();
    watching += detector.ready() ? 1.0 : 0.0;
    detector.step(15.0 + 0.1 * x);
    if (!detector.alarm()) continue;
    ++found;
    detector.relearn();
  }
  return watching / alarms / interval_s;
}

TEST(ChangeDetector, FalseAlarmsComeAsStatedOfALearnedBaseline) {
  for (const auto statistic : kBoth) {
    // A long baseline keeps the stated interval, a short one alarms more rarely, never more often.
    const double of_long = false_alarm_ratio(statistic, 1000.0, 300.0, 300);
    EXPECT_GT(of_long, 0.9) << static_cast<int>(statistic);
    EXPECT_LT(of_long, statistic == ChangeStatistic::cusum ? 3.5 : 1.6);
    EXPECT_GT(false_alarm_ratio(statistic, 30.0, 300.0, 300), of_long) << static_cast<int>(statistic);
  }
}

TEST(ChangeDetector, FindsAStepItsTimeAndItsSize) {
  for (const auto statistic : kBoth) {
    Normal normal(5);
    double late = 0.0, squared_error = 0.0, squared_time = 0.0;
    constexpr int kRuns = 200;
    for (int run = 0; run < kRuns; ++run) {
      auto detector = *Detector::create(by_value(statistic, 1e6));
      for (int n = 0; n < 400; ++n) {
        const double step = n >= 200 ? -2.0 : 0.0;
        detector.step(50.0 + step + normal());
      }
      ASSERT_TRUE(detector.alarm()) << run;
      const auto change = detector.change();
      ASSERT_GT(change.detected_s, 200.0);
      late += (change.detected_s - 200.0) / kRuns;
      squared_time += std::pow(change.time_s - 200.0, 2) / kRuns;
      squared_error += std::pow((change.size + 2.0) / change.size_std, 2) / kRuns;
    }
    EXPECT_LT(late, 14.0) << static_cast<int>(statistic);
    EXPECT_LT(std::sqrt(squared_time), 5.0);
    EXPECT_NEAR(squared_error, 1.0, 0.45) << static_cast<int>(statistic);
  }
}

TEST(ChangeDetector, LearnsWhatIsThere) {
  auto detector = *Detector::create(by_value(ChangeStatistic::cusum, 1e6));
  Normal normal(6);
  EXPECT_FALSE(detector.ready());
  for (int n = 0; n < 500; ++n) detector.step(-3.0 + 0.25 * normal());
  EXPECT_TRUE(detector.ready());
  EXPECT_TRUE(detector.reliable());
  EXPECT_NEAR(detector.baseline(), -3.0, 0.05);
  EXPECT_NEAR(detector.block_std(), 0.25, 0.03);
  EXPECT_LT(detector.level(), 1.0);
}

TEST(ChangeDetector, SaysWhereTheStatedRateCannotHold) {
  // A slow wandering below white noise: correlated over far more than three blocks.
  auto config = by_value(ChangeStatistic::cusum, 1e6);
  config.baseline_s = 4000.0;
  auto detector = *Detector::create(config);
  auto white = detector;
  Normal normal(7);
  double slow = 0.0;
  for (int n = 0; n < 4000; ++n) {
    slow = 0.98 * slow + 0.2 * normal();
    detector.step(slow + normal());
    white.step(normal());
  }
  EXPECT_FALSE(detector.reliable());
  EXPECT_TRUE(white.reliable());
}

TEST(ChangeDetector, WeighsValuesByTheirStandardDeviation) {
  // Half of the values tell ten times less; without weights they would hide the change for long.
  double late[2] = {0.0, 0.0};
  for (int weighted = 0; weighted < 2; ++weighted)
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      Normal normal(100 + seed);
      auto config = by_value(ChangeStatistic::likelihood_ratio, 1e6);
      config.sample_rate_hz = 4.0;
      auto detector = *Detector::create(config);
      for (int n = 0; n < 4000; ++n) {
        const double sd = n % 2 == 0 ? 1.0 : 10.0;
        detector.step((n >= 1000 ? 1.5 : 0.0) + sd * normal(), weighted == 1 ? sd : 1.0);
      }
      late[weighted] += (detector.alarm() ? detector.change().detected_s - 250.0 : 750.0) / 40.0;
    }
  EXPECT_LT(late[1], 15.0);
  EXPECT_GT(late[0], 3.0 * late[1]);
}

TEST(ChangeDetector, MissingValuesAreSkippedAndCounted) {
  auto config = by_value(ChangeStatistic::likelihood_ratio, 1e6);
  config.sample_rate_hz = 10.0;
  auto whole = *Detector::create(config);
  auto holes = whole;
  Normal normal(8);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (int n = 0; n < 3000; ++n) {
    const double x = (n > 2000 ? 1.0 : 0.0) + normal();
    whole.step(x);
    if (n % 3 == 0)
      holes.step(n % 2 == 0 ? kNan : std::numeric_limits<double>::infinity());
    else if (n % 3 == 1)
      holes.step(x, n % 100 == 1 ? kNan : 1.0);
    else
      holes.step(x);
  }
  EXPECT_GE(holes.skipped_samples(), 1000U);
  EXPECT_EQ(holes.samples(), 3000U);
  ASSERT_TRUE(whole.alarm());
  ASSERT_TRUE(holes.alarm());
  EXPECT_NEAR(holes.change().detected_s, whole.change().detected_s, 5.0);
  auto empty = *Detector::create(config);
  for (int n = 0; n < 1000; ++n) empty.step(kNan);
  EXPECT_FALSE(empty.ready());
  EXPECT_EQ(empty.skipped_samples(), 1000U);
}

TEST(ChangeDetector, WhatFollowsAGapIsNotTakenForWhatFollowsItsNeighbour) {
  // Blocks that hang together, with a gap after every 20: told as before a gap, its first block would be 2.3
  // standard deviations off in the mean square.
  constexpr double kInterval = 500.0, kPhi = 0.9;
  constexpr int kAlarms = 100;
  auto config = by_value(ChangeStatistic::likelihood_ratio, kInterval);
  config.baseline_s = 3000.0;
  Normal normal(14);
  double x = 0.0, watched = 0.0;
  int alarms = 0;
  auto detector = *Detector::create(config);
  for (int n = 0; alarms < kAlarms; ++n) {
    x = kPhi * x + normal();
    detector.step(n % 50 < 20 ? x : std::numeric_limits<double>::quiet_NaN());
    if (detector.ready() && n % 50 < 20) watched += 1.0;
    if (!detector.alarm()) continue;
    ++alarms;
    detector.resume();
  }
  EXPECT_GE(watched / kAlarms, 0.6 * kInterval);
  EXPECT_LE(watched / kAlarms, 2.5 * kInterval);
}

TEST(ChangeDetector, ResetAndCopiesReproduceBitForBit) {
  auto detector = *Detector::create(by_value(ChangeStatistic::likelihood_ratio, 1e4));
  const auto run = [](Detector& d) {
    Normal normal(9);
    double sum = 0.0;
    for (int n = 0; n < 300; ++n) {
      d.step(normal() + (n > 200 ? 3.0 : 0.0));
      sum += d.level();
    }
    return sum + d.change().size;
  };
  auto copy = detector;
  const double first = run(detector);
  EXPECT_EQ(run(copy), first);
  detector.reset();
  EXPECT_FALSE(detector.alarm());
  EXPECT_EQ(detector.samples(), 0U);
  EXPECT_EQ(run(detector), first);
}

TEST(ChangeDetector, AConstantFigureRaisesNoAlarm) {
  auto detector = *Detector::create(by_value(ChangeStatistic::likelihood_ratio, 1e4));
  for (int n = 0; n < 1000; ++n) detector.step(15.0);
  EXPECT_FALSE(detector.alarm());
  EXPECT_EQ(detector.baseline(), 15.0);
}

TEST(ChangeDetector, StepTakesNoMemory) {
  auto detector = *ChangeDetector<float>::create(by_value(ChangeStatistic::likelihood_ratio, 1e4));
  Normal normal(10);
  const auto before = test::allocations();
  for (int n = 0; n < 2000; ++n) detector.step(static_cast<float>(normal()));
  detector.relearn();
  EXPECT_EQ(test::allocations(), before);
}

TEST(ChangeDetector, RefusesNamingFieldAndRequirement) {
  const auto field = [](auto change) {
    auto config = by_value(ChangeStatistic::cusum, 1e4);
    change(config);
    const auto detector = Detector::create(config);
    return detector ? std::string() : detector.error().field.str();
  };
  EXPECT_EQ(field([](auto&) {}), "");
  EXPECT_EQ(field([](auto& c) { c.sample_rate_hz = 0.0; }), "sample_rate_hz");
  EXPECT_EQ(field([](auto& c) { c.block_s = 0.5; }), "block_s");
  EXPECT_EQ(field([](auto& c) { c.baseline_s = 15.0; }), "baseline_s");
  EXPECT_EQ(field([](auto& c) { c.false_alarm_interval_s = 49.0; }), "false_alarm_interval_s");
  EXPECT_EQ(field([](auto& c) { c.reference = 0.0; }), "reference");
  EXPECT_EQ(field([](auto& c) { c.window_blocks = 257; }), "window_blocks");
  EXPECT_EQ(field([](auto& c) { c.window_blocks = 0; }), "window_blocks");
  EXPECT_EQ(field([](auto& c) { c.baseline_s = std::numeric_limits<double>::quiet_NaN(); }), "baseline_s");
}

}  // namespace
}  // namespace resonid::online
