// SPDX-License-Identifier: MIT
#include <monitor/store/summary.hpp>

#include "store_folder.hpp"

namespace resonid::monitor::test {
namespace {

/// Exponentially correlated, standard deviation 1, correlation 1/e after `memory` steps.
class Correlated {
 public:
  Correlated(double memory, std::mt19937_64& random)
      : kept_(std::exp(-1.0 / memory)), state_(normal_(random)) {}
  double next(std::mt19937_64& random) {
    return state_ = kept_ * state_ + std::sqrt(1 - kept_ * kept_) * normal_(random);
  }

 private:
  std::normal_distribution<double> normal_;
  double kept_, state_;
};

struct Case {
  const char* name;
  int rows;
  double memory;  // of the estimator, in rows; its std is 1
  double wander_memory, wander;
  double told_std;  // by the estimator; 0: nothing told
};

double coverage_of(const Case& c, int runs) {
  std::mt19937_64 random(7);
  int inside = 0;
  for (int run = 0; run < runs; ++run) {
    Correlated noise(c.memory, random), wander(c.wander_memory, random);
    FigureGatherer rows;
    for (int i = 0; i < c.rows; ++i)
      rows.add(i * kSecond,
               {100.0 + noise.next(random) + (c.wander > 0.0 ? c.wander * wander.next(random) : 0.0),
                c.told_std > 0.0 ? c.told_std : FigureSummary::kUnknown},
               true);
    const auto summary = rows.summary(c.memory);
    inside += std::abs(summary.mean - 100.0) <= 1.959964 * summary.std ? 1 : 0;
  }
  return 100.0 * inside / runs;
}

TEST(Summary, StandardDeviationOfAnHoursMeanCovers) {
  for (const Case& c :
       {Case{"rows one by one", 3600, 0.1, 1, 0, 1}, Case{"memory 5 s", 3600, 5, 1, 0, 1},
        Case{"memory 20 s", 3600, 20, 1, 0, 1}, Case{"memory 60 s", 3600, 60, 1, 0, 1},
        Case{"memory 60 s, no std told", 3600, 60, 1, 0, 0}, Case{"told half of it", 3600, 20, 1, 0, 0.5},
        Case{"wander 60 s", 3600, 20, 60, 1, 1}, Case{"wander 120 s", 3600, 20, 120, 1, 1},
        Case{"wander 300 s", 3600, 20, 300, 1, 1}, Case{"wander 300 s, strong", 3600, 20, 300, 3, 1},
        Case{"slow wander, long memory", 3600, 60, 300, 1, 1}, Case{"20 minutes", 1200, 20, 60, 1, 1},
        Case{"10 minutes", 600, 20, 1, 0, 1}, Case{"10 minutes, memory 60 s", 600, 60, 1, 0, 1},
        Case{"2 minutes, memory 30 s", 120, 30, 1, 0, 1}}) {
    const double coverage = coverage_of(c, 2000);  // its own standard deviation is 0.5
    RecordProperty(c.name, std::to_string(coverage));
    EXPECT_GE(coverage, 92.0 - 1.0) << c.name;
    EXPECT_LE(coverage, 98.0 + 0.8) << c.name;
  }
}

TEST(Summary, StandardDeviationOfADaysMeanCovers) {
  constexpr int kRuns = 200;
  std::mt19937_64 random(8);
  for (const double wander_s : {1.0, 600.0, 3600.0}) {
    int inside = 0;
    for (int run = 0; run < kRuns; ++run) {
      Correlated noise(20, random), wander(wander_s, random);
      std::vector<FigureSummary> hours;
      for (int hour = 0; hour < 24; ++hour) {
        FigureGatherer rows;
        for (int i = 0; i < 3600; ++i)
          rows.add(i * kSecond, {noise.next(random) + (wander_s > 1.0 ? wander.next(random) : 0.0), 1.0},
                   true);
        hours.push_back(rows.summary(20.0));
      }
      const auto day = combine(hours);
      inside += std::abs(day.mean) <= 1.959964 * day.std ? 1 : 0;
    }
    const double coverage = 100.0 * inside / kRuns;
    RecordProperty("day_wander_" + std::to_string(static_cast<int>(wander_s)), std::to_string(coverage));
    EXPECT_GE(coverage, 92.0 - 3.0) << wander_s;
    EXPECT_LE(coverage, 98.0 + 2.0) << wander_s;
  }
}

TEST(Summary, StandardDeviationOfAFewFiveMinutesCoversWhereTheirErrorsAreAlike) {
  // Estimates are alike over 60 s: of the mean of two or three stretches that follow each other the
  // independent errors of each would cover too little.
  constexpr int kRuns = 4000;
  std::mt19937_64 random(9);
  for (const int stretches : {1, 2, 3, 6}) {
    int inside = 0, independent = 0;
    for (int run = 0; run < kRuns; ++run) {
      Correlated noise(60, random);
      std::vector<FigureSummary> parts;
      for (int part = 0; part < stretches; ++part) {
        FigureGatherer rows;
        for (int i = 0; i < 300; ++i) rows.add(i * kSecond, {noise.next(random), 1.0}, true);
        parts.push_back(rows.summary(60.0));
      }
      const auto point = combine(parts, 60.0 / 300.0);
      inside += std::abs(point.mean) <= 1.959964 * point.own_std ? 1 : 0;
      independent += std::abs(point.mean) <= 1.959964 * combine(parts).own_std ? 1 : 0;
      EXPECT_GE(point.std, point.own_std);
    }
    const double coverage = 100.0 * inside / kRuns;  // its own standard deviation is 0.35
    RecordProperty("stretches_" + std::to_string(stretches), std::to_string(coverage));
    EXPECT_NEAR(coverage, 95.0, 1.2) << stretches;
    EXPECT_LT(100.0 * independent / kRuns, stretches > 2 ? 94.0 : 100.0) << stretches;
  }
}

TEST(Summary, MeanSpreadAndExtremesAreThoseOfTheTrustedRows) {
  FigureGatherer rows;
  for (int i = 0; i < 4; ++i) rows.add(i * kSecond, {static_cast<double>(i), 0.1}, true);  // 0 1 2 3
  rows.add(5 * kSecond, {1000.0, 0.1}, false);
  rows.add(6 * kSecond, {}, true);
  const auto summary = rows.summary(0.0);
  EXPECT_EQ(summary.rows, 5U);
  EXPECT_EQ(summary.trusted, 4U);
  EXPECT_DOUBLE_EQ(summary.mean, 1.5);
  EXPECT_DOUBLE_EQ(summary.spread, std::sqrt(1.25));
  EXPECT_DOUBLE_EQ(summary.min, 0.0);
  EXPECT_DOUBLE_EQ(summary.max, 3.0);
  EXPECT_DOUBLE_EQ(summary.own_std, 0.05);
}

TEST(Summary, UntrustedRowsAloneHaveNoStandardDeviation) {
  FigureGatherer rows;
  for (int i = 0; i < 100; ++i) rows.add(i * kSecond, {2.0 + i % 2, 0.1}, false);
  const auto summary = rows.summary(1.0);
  EXPECT_EQ(summary.trusted, 0U);
  EXPECT_DOUBLE_EQ(summary.mean, 2.5);
  EXPECT_TRUE(std::isnan(summary.std));
}

TEST(Summary, OneRowHasItsOwnStandardDeviation) {
  FigureGatherer rows;
  rows.add(0, {5.0, 0.25}, true);
  EXPECT_DOUBLE_EQ(rows.summary(30.0).std, 0.25);
}

TEST(Summary, ManyRowsWithinTheMemoryAreOneEstimate) {
  FigureGatherer rows;
  for (int i = 0; i < 10; ++i) rows.add(i * kSecond, {5.0, 0.25}, true);
  EXPECT_NEAR(rows.summary(1e6).std, 0.25, 1e-3);
}

TEST(Summary, StretchesTogetherAreWhatAllRowsAre) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(10.0, 2.0);
  FigureGatherer all, part;
  std::vector<FigureSummary> parts;
  for (const int rows : {50, 400, 10}) {
    for (int i = 0; i < rows; ++i) {
      const double value = normal(random);
      all.add(i * kSecond, {value, 0.1}, true);
      part.add(i * kSecond, {value, 0.1}, true);
    }
    parts.push_back(part.summary(0.0));
    part.clear();
  }
  parts.push_back({});  // an hour without rows
  const auto whole = all.summary(0.0), combined = combine(parts);
  EXPECT_EQ(combined.trusted, whole.trusted);
  EXPECT_NEAR(combined.mean, whole.mean, 1e-12);
  EXPECT_NEAR(combined.spread, whole.spread, 1e-12);
  EXPECT_EQ(combined.min, whole.min);
  EXPECT_EQ(combined.max, whole.max);
  EXPECT_NEAR(combined.own_std, whole.own_std, 1e-12);
}

TEST(Summary, BytesComeBack) {
  Summary summary;
  summary[2] = {100, 90, 1.0, 2.0, -3.0, 4.0, 0.5, FigureSummary::kUnknown};
  summary[10] = {1, 0, 7.0, 0.0, 7.0, 7.0, FigureSummary::kUnknown, FigureSummary::kUnknown};
  const std::string bytes = encode_summary(summary);
  const auto back = decode_summary(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ((*back)[2].rows, 100U);
  EXPECT_EQ((*back)[2].min, -3.0);
  EXPECT_EQ((*back)[2].std, 0.5);
  EXPECT_TRUE(std::isnan((*back)[2].own_std));
  EXPECT_EQ((*back)[10].mean, 7.0);
  EXPECT_EQ((*back)[0].rows, 0U);
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(decode_summary(std::string_view(bytes).substr(0, size)));
  EXPECT_FALSE(decode_summary(bytes + "x"));
}

}  // namespace
}  // namespace resonid::monitor::test
