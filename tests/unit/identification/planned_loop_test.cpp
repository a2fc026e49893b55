// SPDX-License-Identifier: MIT
// What the lines of a loop tell of a controller that is to run, and what they do not.
#include <gtest/gtest.h>

#include <cmath>
#include <identification/identify/judge/planned_loop.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/data/controller.hpp>

namespace resonid::identification::detail {
namespace {

using Complex = std::complex<double>;
constexpr double kStep_s = 0.004, kConfidence = 0.95;

data::Controller pi(double gain) {
  return data::Controller(data::Controller::Pi{gain, 0.2}).sampled(kStep_s);
}

/// A cascade, C (1 + kv q).
data::Controller cascade(double gain, double integral_time_s, double position_gain) {
  const double a = kStep_s / integral_time_s, b = kStep_s * position_gain;
  return data::TransferFunction{
      {gain * (1.0 + a) * (1.0 + b), -gain * (2.0 + a + b), gain}, {1.0, -2.0, 1.0}, kStep_s};
}

/// Anti-resonance 41 Hz, resonance 55 Hz, damping ratios 0.05, delay 5 ms.
Complex machine(double hz) {
  const Complex s(0.0, kTwoPi * hz);
  const auto pair = [&](double of_hz) {
    const Complex x = s / (kTwoPi * of_hz);
    return x * x + 0.1 * x + 1.0;
  };
  return pair(41.0) / pair(55.0) / (0.005 * s) * std::exp(-0.005 * s);
}

/// Ten lines per Hz, known to 2 %.
LoopResult loop_of_lines(double from_hz, double to_hz, const data::Controller& controller) {
  LoopResult loop;
  loop.source = "response";
  const int lines = static_cast<int>(std::lround(10.0 * (to_hz - from_hz)));
  for (int i = 0; i <= lines; ++i) {
    const double hz = from_hz + 0.1 * i;
    loop.curve.frequency_hz.push_back(hz);
    loop.curve.value.push_back(controller.response(hz) * machine(hz));
    loop.curve.std.push_back(0.02 * std::abs(loop.curve.value.back()));
  }
  loop.margins = diagnostics::loop_margins(loop.curve);
  return loop;
}

std::string told(double from_hz, double to_hz, const data::Controller& controller) {
  const auto finding = judge_by_lines(loop_of_lines(from_hz, to_hz, controller), controller, kConfidence);
  return finding ? finding->id : "stable";
}

/// |L| is 0.24 at 47 Hz, and rises: at the resonance it is above 1.
TEST(PlannedLoop, IsNotJudgedByLinesThatEndBelowAResonance) {
  EXPECT_EQ(told(1.5, 47.0, pi(0.3)), "planned-not-judged");
  EXPECT_EQ(told(1.5, 47.0, pi(0.1)), "planned-not-judged");
  // Far below the anti-resonance nothing tells of it, but 1/2 is the most.
  EXPECT_EQ(told(1.5, 12.0, pi(0.1)), "stable");
  EXPECT_EQ(told(1.5, 12.0, pi(0.25)), "planned-not-judged");
}

/// Past the resonance |L| falls, whatever the anti-resonance below it was.
TEST(PlannedLoop, IsJudgedByLinesThatEndAboveTheResonance) {
  EXPECT_EQ(told(1.5, 80.0, pi(0.2)), "stable");
  EXPECT_EQ(told(1.5, 80.0, pi(0.6)), "planned-unstable");
  EXPECT_EQ(told(1.5, 120.0, pi(0.35)), "stable");
  EXPECT_EQ(told(1.5, 120.0, pi(0.6)), "planned-unstable");
}

/// Between anti-resonance and resonance the machine leads by 90 deg less its delay, which may look like an
/// inertia's lag, and 1 + L lies on a turn that the lines do not show.
TEST(PlannedLoop, IsNotJudgedByLinesThatBeginAboveAnAntiResonance) {
  for (const double from_hz : {50.0, 52.0})
    for (const double to_hz : {65.0, 80.0, 120.0})
      EXPECT_EQ(told(from_hz, to_hz, pi(2.0)), "planned-not-judged") << from_hz << " " << to_hz;
}

/// Below its corners a cascade lags by 270 deg, and comes back.
TEST(PlannedLoop, OfACascadeIsNotUnstableBelowItsCorners) {
  EXPECT_EQ(told(0.5, 3.0, cascade(0.1, 0.1, 20.0)), "planned-not-judged");
  EXPECT_EQ(told(0.2, 1.0, cascade(0.1, 0.2, 20.0)), "planned-not-judged");
  EXPECT_EQ(told(0.2, 80.0, cascade(0.06, 0.2, 3.0)), "stable");
}

/// 0.1 with a pair of poles at that frequency, and of zeros, by their distances from 0.
data::Controller with_pair(double hz, double poles, double zeros) {
  const double cosine = std::cos(kTwoPi * hz * kStep_s);
  return data::TransferFunction{{0.1, -0.2 * zeros * cosine, 0.1 * zeros * zeros},
                                {1.0, -2.0 * poles * cosine, poles * poles},
                                kStep_s};
}

/// Poles outside of the circle, which 1 + L must go around; a pair 0.02 Hz wide where lines are 0.1 Hz apart;
/// and one above the last line, where the controller is 20 times as large.
TEST(PlannedLoop, IsNotJudgedWhereTheLinesDoNotShowItsController) {
  EXPECT_EQ(told(1.5, 80.0, with_pair(20.0, 0.951, 0.9)), "stable");
  EXPECT_EQ(told(1.5, 80.0, with_pair(20.0, 1.01, 0.9)), "planned-not-judged");
  EXPECT_EQ(told(1.5, 80.0, with_pair(20.0, 0.9995, 0.9)), "planned-not-judged");
  EXPECT_EQ(told(1.5, 80.0, with_pair(100.0, 0.8, 0.8)), "stable");
  EXPECT_EQ(told(1.5, 80.0, with_pair(100.0, 0.99, 0.8)), "planned-not-judged");
  const auto unstable = with_pair(20.0, 1.01, 0.9), resonant = with_pair(100.0, 0.99, 0.8);
  const auto by_itself = judge_by_lines(loop_of_lines(1.5, 80.0, unstable), unstable, kConfidence);
  ASSERT_TRUE(by_itself);
  EXPECT_NE(by_itself->meaning.find("must be stable but for integrators"), std::string::npos)
      << by_itself->meaning;
  const auto above = judge_by_lines(loop_of_lines(1.5, 80.0, resonant), resonant, kConfidence);
  ASSERT_TRUE(above);
  EXPECT_NE(above->meaning.find("the controller becomes larger above it"), std::string::npos)
      << above->meaning;
}

/// L = 1/(j f/f1) exp(-j 2 pi f tau): -180 deg at 1/(4 tau), where |L| falls as 1/f.
TEST(PlannedLoop, HasAnErrorOfItsGainMarginByTheLines) {
  constexpr double kDelay_s = 0.01, kRelative = 0.01;
  data::FrequencyResponse loop;
  for (const double hz : {24.5, 25.5}) {
    loop.frequency_hz.push_back(hz);
    loop.value.push_back(10.0 / Complex(0.0, hz) * std::polar(1.0, -kTwoPi * hz * kDelay_s));
    loop.std.push_back(kRelative * std::abs(loop.value.back()));
  }
  const auto margins = diagnostics::loop_margins(loop);
  ASSERT_TRUE(margins.gain_margin_hz);
  EXPECT_NEAR(*margins.gain_margin_hz, 25.0, 0.01);
  // In the middle both lines err by half each: of arg L r/2, which moves the crossing by r/(4 pi tau).
  const double expected = 20.0 / std::log(10.0) * kRelative * std::hypot(0.5, 1.0 / kPi);
  const auto std_db = gain_margin_std_db(loop, *margins.gain_margin_hz);
  ASSERT_TRUE(std_db);
  EXPECT_NEAR(*std_db, expected, 0.02 * expected);
  EXPECT_FALSE(gain_margin_std_db(loop, 30.0));
}

/// Falling below the anti-resonance, rising and falling again around the resonance.
TEST(PlannedLoop, HasAllItsCrossings) {
  const auto loop = loop_of_lines(1.5, 80.0, pi(0.35));
  const auto crossings = crossings_of(loop.curve);
  ASSERT_EQ(crossings.size(), 3U);
  EXPECT_TRUE(crossings[0].falling && !crossings[1].falling && crossings[2].falling);
  double least = 360.0;
  for (const auto& c : crossings) {
    const Complex at = pi(0.35).response(c.frequency_hz) * machine(c.frequency_hz);
    EXPECT_NEAR(std::abs(at), 1.0, 0.01) << c.frequency_hz;
    EXPECT_NEAR(std::remainder(180.0 + std::arg(at) * 180.0 / kPi - c.phase_margin_deg, 360.0), 0.0, 1.0);
    ASSERT_TRUE(c.phase_margin_std_deg);
    EXPECT_GT(*c.phase_margin_std_deg, 0.0);
    least = std::min(least, std::abs(c.phase_margin_deg));
  }
  ASSERT_TRUE(loop.margins.worst_phase_margin_deg);
  EXPECT_NEAR(least, std::abs(*loop.margins.worst_phase_margin_deg), 1e-9);
  ASSERT_EQ(loop.margins.crossovers.size(), 2U);
  EXPECT_NEAR(crossings[2].frequency_hz, loop.margins.crossovers[1].frequency_hz, 1e-9);
}

TEST(PlannedLoop, IsWarnedOfWithinItsErrors) {
  LoopResult loop;
  loop.margins.worst_phase_margin_deg = 50.0;
  loop.margins.modulus_margin = 0.7;
  EXPECT_FALSE(inspect_planned_margins(loop));
  loop.margins.worst_phase_margin_deg = -9.5;
  loop.margins.modulus_margin = 0.1;
  ASSERT_TRUE(inspect_planned_margins(loop));
  EXPECT_EQ(inspect_planned_margins(loop)->id, "planned-small-margins");
  loop.modulus_margin_std = 0.04;
  EXPECT_EQ(inspect_planned_margins(loop)->id, "planned-small-margins");
  loop.modulus_margin_std = 0.06;
  EXPECT_EQ(inspect_planned_margins(loop)->id, "planned-may-be-unstable");
}

}  // namespace
}  // namespace resonid::identification::detail
