// SPDX-License-Identifier: MIT
// Margins by lines and their disks, against closed forms and against those of the machine itself.
#include "design/line_margins.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <resonid/base/constants.hpp>

#include "design/figures.hpp"
#include "design/same_crossing.hpp"
#include "golden_posteriors.hpp"

namespace resonid::design {
namespace {

struct LoopOnLines {
  std::vector<double> frequencies_hz, radii;
  std::vector<std::complex<double>> values;

  /// (5 Hz/f) exp(-j 90 deg - j 2 pi f delay), each line to a tenth of it.
  explicit LoopOnLines(double delay_s) {
    for (double f = 1.0; f <= 40.0; f += 0.25) {
      frequencies_hz.push_back(f);
      values.push_back(std::polar(5.0 / f, -0.5 * kPi - kTwoPi * f * delay_s));
      radii.push_back(0.5 / f);
    }
  }
  [[nodiscard]] LineMargins margins() const { return line_margins(frequencies_hz, values, radii); }
};

TEST(LineMargins, AreThoseOfAnIntegrator) {
  const auto m = LoopOnLines(0.0).margins();
  ASSERT_EQ(m.crossings.size(), 1U);
  EXPECT_NEAR(m.crossings.front().frequency_hz, 5.0, 1e-9);
  EXPECT_TRUE(m.crossings.front().falling);
  ASSERT_TRUE(m.phase_deg && m.delay_s);
  EXPECT_NEAR(m.phase_deg->value, 90.0, 1e-9);
  // A circle of a tenth around L takes its angle by asin(0.1) at most, by acos(1 - 0.1^2/2) at the crossing.
  EXPECT_GE(m.phase_deg->worst, 90.0 - 5.7392);
  EXPECT_LE(m.phase_deg->worst, 90.0 - 5.7319);
  EXPECT_EQ(m.worst_deg, std::vector<double>{m.phase_deg->worst});
  EXPECT_NEAR(m.delay_s->value, 0.25 / 5.0, 1e-9);
  EXPECT_LT(m.delay_s->worst, m.delay_s->value * 85.0 / 90.0);
  EXPECT_FALSE(m.gain_db);
}

/// 10 ms more: -180 deg at 25 Hz, where it is a fifth.
TEST(LineMargins, AreThoseOfADelay) {
  const auto m = LoopOnLines(0.01).margins();
  ASSERT_TRUE(m.phase_deg && m.gain_db && m.delay_s);
  EXPECT_NEAR(m.phase_deg->value, 90.0 - 18.0, 1e-6);
  EXPECT_LT(m.phase_deg->worst, 72.0 - 5.73);
  EXPECT_GT(m.phase_deg->worst, 72.0 - 9.0);
  EXPECT_NEAR(m.delay_s->value, 0.05 - 0.01, 1e-9);
  EXPECT_NEAR(m.gain_db->value, 20.0 * std::log10(5.0), 0.01);
  // A tenth more there; lines a little below reach the axis too, a little farther out.
  EXPECT_LE(m.gain_db->worst, 20.0 * std::log10(5.0 / 1.1) + 1e-3);
  EXPECT_GT(m.gain_db->worst, 20.0 * std::log10(5.0 / 1.1) - 0.3);
}

TEST(LineMargins, AreNoneWhereADiskReachesMinusOne) {
  const std::vector<double> f = {1.0, 2.0, 3.0, 4.0};
  const std::vector<std::complex<double>> loop = {{0.0, -4.0}, {-1.05, -0.05}, {-0.5, 0.1}, {-0.2, 0.2}};
  const std::vector<double> radii = {0.1, 0.1, 0.01, 0.01};
  const auto m = line_margins(f, loop, radii);
  ASSERT_TRUE(m.phase_deg && m.delay_s);
  EXPECT_EQ(m.phase_deg->worst, 0.0);
  EXPECT_EQ(m.delay_s->worst, 0.0);
  ASSERT_TRUE(m.gain_db);
  EXPECT_GT(m.gain_db->value, 0.0);
  EXPECT_NEAR(m.gain_db->worst, 0.0, 1e-12);
}

/// A pair of crossings beside a resonance may be there on one machine and not on another.
TEST(SameCrossing, IsTheNearestOfItsDirectionEitherWay) {
  const std::vector<Crossing> here = {{5.0, 60.0, true}, {12.0, -170.0, false}, {20.0, 45.0, true}};
  const std::vector<Crossing> moved = {{6.0, 55.0, true}, {13.0, -165.0, false}, {18.0, 50.0, true}};
  for (std::size_t i = 0; i < here.size(); ++i) EXPECT_EQ(same_crossing(moved, here, here[i]), &moved[i]);
  const std::vector<Crossing> lost = {{6.0, 55.0, true}};
  EXPECT_EQ(same_crossing(lost, here, here[0]), &lost[0]);
  EXPECT_EQ(same_crossing(lost, here, here[1]), nullptr);
  EXPECT_EQ(same_crossing(lost, here, here[2]), nullptr);
  EXPECT_EQ(same_crossing(std::vector<Crossing>(), here, here[0]), nullptr);
}

/// A line further up may be -1 within its disk, which is the least margin: at the crossing, a line below it
/// that does not reach 1, the phase margin of 90 deg loses what the disk of 0.01 takes, 0.57 deg.
TEST(LineMargins, TellTheWorstOfEachCrossing) {
  const std::vector<double> f = {1.0, 2.0, 3.0, 4.0};
  const std::vector<std::complex<double>> loop = {{0.0, -4.0}, {0.0, -0.5}, {-0.95, -0.1}, {0.0, -0.2}};
  const auto m = line_margins(f, loop, std::vector<double>{0.01, 0.01, 0.2, 0.01});
  ASSERT_EQ(m.crossings.size(), 1U);
  ASSERT_EQ(m.worst_deg.size(), 1U);
  EXPECT_NEAR(m.crossings.front().phase_margin_deg, 90.0, 1e-9);
  EXPECT_NEAR(m.worst_deg.front(), 90.0 - 0.573, 1e-3);
  ASSERT_TRUE(m.phase_deg);
  EXPECT_EQ(m.phase_deg->worst, 0.0);
}

/// As of a controller that is zero at a line: it crosses on either side of it.
TEST(LineMargins, AreFiniteBesideALineWithoutALoop) {
  const std::vector<double> f = {1.0, 2.0, 3.0, 4.0};
  const std::vector<std::complex<double>> loop = {{0.0, -4.0}, 0.0, {0.0, -2.0}, {-0.1, -0.2}};
  const auto m = line_margins(f, loop, std::vector<double>(4, 0.0));
  ASSERT_EQ(m.crossings.size(), 3U);
  for (const auto& crossing : m.crossings)
    EXPECT_TRUE(std::isfinite(crossing.frequency_hz) && std::isfinite(crossing.phase_margin_deg));
  EXPECT_GT(m.crossings[0].frequency_hz, 1.0);
  EXPECT_LT(m.crossings[0].frequency_hz, 2.0);
  ASSERT_TRUE(m.phase_deg && m.delay_s);
  EXPECT_TRUE(std::isfinite(m.phase_deg->worst) && std::isfinite(m.delay_s->worst));
}

/// On the lines of the golden response, and exactly on its machine.
TEST(LineMargins, AgreeWithThoseOfTheMachine) {
  const auto golden = test::golden_json("e_tune_robust.json");
  const auto& disk = golden.at("disk");
  const auto frequencies_hz = disk.at("frequency_hz").get<std::vector<double>>();
  constexpr double kStep = 0.002;
  const LinearController controller(FilteredPi{2.5, 3.0, {}}, kStep);
  auto loop = controller.at(frequencies_hz);
  for (std::size_t i = 0; i < loop.size(); ++i)
    loop[i] *= std::complex(disk.at("real")[i].get<double>(), disk.at("imag")[i].get<double>());
  const auto lines = line_margins(frequencies_hz, loop, std::vector<double>(loop.size(), 0.0));
  const Machine machine(test::golden_posterior(golden.at("cases")[0]).nominal());
  const auto exact = figures_of(machine, controller);
  ASSERT_EQ(lines.crossings.size(), exact.crossings.size());
  for (std::size_t i = 0; i < exact.crossings.size(); ++i) {
    EXPECT_NEAR(lines.crossings[i].frequency_hz, exact.crossings[i].frequency_hz, 0.1);
    EXPECT_NEAR(lines.crossings[i].phase_margin_deg, exact.crossings[i].phase_margin_deg, 2.0);
    EXPECT_EQ(lines.crossings[i].falling, exact.crossings[i].falling);
    EXPECT_NEAR(lines.worst_deg.at(i), lines.crossings[i].phase_margin_deg, 1e-4);  // nothing is uncertain
  }
  ASSERT_TRUE(lines.gain_db && exact.gain_margin_db && lines.delay_s && exact.delay_margin_s);
  EXPECT_NEAR(lines.gain_db->value, *exact.gain_margin_db, 0.3);
  EXPECT_NEAR(lines.delay_s->value, *exact.delay_margin_s, 0.05 * *exact.delay_margin_s);
  EXPECT_NEAR(lines.gain_db->worst, lines.gain_db->value, 0.05);
}

}  // namespace
}  // namespace resonid::design
