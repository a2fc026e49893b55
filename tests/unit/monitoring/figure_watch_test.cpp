// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <monitoring/figure_watch.hpp>
#include <random>

namespace resonid::monitoring {
namespace {

/// Phase margins around 60 degrees, 0.1 degrees of noise, one per second.
struct Margins {
  FigureWatch watch = FigureWatch::create(1.0, 4.0, 400.0, 3.6e5).value();
  AxisAlarmSettings settings;
  std::mt19937_64 generator{7};
  std::normal_distribution<double> noise{0.0, 0.1};
  double load_torque = 0.0;

  /// Whether a change was told at any time.
  bool run(int seconds, double shift) {
    bool told = false;
    for (int k = 0; k < seconds; ++k) {
      Row row;
      row.trusted = true;
      row[Watched::phase_margin] = {60.0 + shift + noise(generator), 0.1};
      row[Watched::load_torque] = {load_torque, 0.01};
      watch.step(row, settings);
      told = told || changed();
    }
    return told;
  }
  [[nodiscard]] bool changed() const {
    return watch.changes(0.0)[static_cast<std::size_t>(Watched::phase_margin)].changed;
  }
};

TEST(FigureWatch, TellsNoChangeThatIsSmallerThanTheLeastOne) {
  Margins m;
  ASSERT_EQ(m.settings[Watched::phase_margin].least_change, 1.0);
  EXPECT_FALSE(m.run(500, 0.0));
  EXPECT_FALSE(m.run(500, 0.5));
  EXPECT_TRUE(m.run(100, 3.0));
  EXPECT_TRUE(m.changed());
}

TEST(FigureWatch, FindsEverySureChangeWhereNoneIsTooSmall) {
  Margins m;
  m.settings[Watched::phase_margin].least_change = 0.0;
  EXPECT_FALSE(m.run(500, 0.0));
  EXPECT_TRUE(m.run(100, 0.5));
}

TEST(FigureWatch, TellsWhatHasGrownBeyondTheLeastChange) {
  Margins m;
  EXPECT_FALSE(m.run(500, 0.0));
  bool told = false;
  for (int step = 1; step <= 9; ++step) told = m.run(60, -0.1 * step) || told;
  EXPECT_FALSE(told);
  for (int step = 10; step <= 25; ++step) told = m.run(60, -0.1 * step) || told;
  EXPECT_TRUE(told);
}

/// A large one the tracker recognises.
TEST(FigureWatch, CountsForLessWhatComesWithASmallJumpOfTheLoad) {
  for (const double jump_nm : {0.0, 0.2, 0.5}) {
    Margins m;
    m.settings[Watched::phase_margin].least_change = 0.0;
    EXPECT_FALSE(m.run(500, 0.0));
    m.load_torque = jump_nm;
    // Seven standard deviations of a block for one block, and back.
    EXPECT_EQ(m.run(4, 0.35) || m.run(40, 0.0), jump_nm != 0.2) << jump_nm;
    // What stays is found all the same.
    EXPECT_TRUE(m.run(60, 0.5));
  }
}

TEST(FigureWatch, TellsAChangeThatHasGrownToMoreThanTwice) {
  Margins m;
  const auto margin = [&m] { return m.watch.changes(0.0)[static_cast<std::size_t>(Watched::phase_margin)]; };
  EXPECT_FALSE(m.run(500, 0.0));
  EXPECT_TRUE(m.run(300, -3.0));
  EXPECT_NEAR(margin().change.size, -3.0, 0.2);
  const auto grows = [&](double shift) {
    bool grown = false;
    for (int k = 0; k < 200; ++k) {
      m.run(1, shift);
      grown = grown || margin().grown;
    }
    return grown;
  };
  EXPECT_FALSE(grows(-5.0));
  EXPECT_TRUE(grows(-9.0));
  EXPECT_NEAR(margin().change.size, -9.0, 1.0);
  EXPECT_FALSE(grows(-9.0));
}

}  // namespace
}  // namespace resonid::monitoring
