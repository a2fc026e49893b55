// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <resonid/plant/detail/motion.hpp>
#include <string>
#include <vector>

namespace resonid::plant {
namespace {

constexpr auto kTrapezoidal = MotionKind::trapezoidal;
constexpr auto kSCurve = MotionKind::s_curve;

MotionProfile make(const MotionConfig& config) { return MotionProfile::create(config).value(); }

void expect_setpoint(const Setpoint& found, double position, double velocity, double acceleration) {
  EXPECT_NEAR(found.position, position, 1e-14);
  EXPECT_NEAR(found.velocity, velocity, 1e-14);
  EXPECT_NEAR(found.acceleration, acceleration, 1e-13);
}

TEST(Motion, StandsStillAndRunsAtConstantVelocity) {
  const auto still = make({MotionKind::standstill, 0, 0, 0, 0.4, 0, 0, 0, false});
  expect_setpoint(still.at(0.0), 0.4, 0.0, 0.0);
  expect_setpoint(still.at(1e6), 0.4, 0.0, 0.0);
  EXPECT_EQ(still.move_duration_s(), 0.0);
  const auto run = make({MotionKind::constant, -0.06, 0, 0, 1.5, 0, 0, 0, false});
  expect_setpoint(run.at(0.0), 1.5, -0.06, 0.0);
  expect_setpoint(run.at(10.0), 0.9, -0.06, 0.0);
  EXPECT_NEAR(run.reached(20.0).lowest, 0.3, 1e-14);
  EXPECT_EQ(run.reached(20.0).highest, 1.5);
}

// 1.6 m at 0.5 m/s and 2 m/s2: ramps of 0.25 s and 0.0625 m, 2.95 s of cruise.
TEST(Motion, TrapezoidByHand) {
  const auto p = make({kTrapezoidal, 0.5, 2.0, 0, 0.1, 1.7, 1.0, 0.5, false});
  EXPECT_NEAR(p.move_duration_s(), 3.45, 1e-14);
  expect_setpoint(p.at(-1.0), 0.1, 0.0, 0.0);
  expect_setpoint(p.at(0.999), 0.1, 0.0, 0.0);
  expect_setpoint(p.at(1.125), 0.1 + 0.015625, 0.25, 2.0);
  expect_setpoint(p.at(2.25), 0.1 + 0.5625, 0.5, 0.0);
  expect_setpoint(p.at(4.325), 1.7 - 0.015625, 0.25, -2.0);
  EXPECT_EQ(p.at(4.45).position, 1.7);
  EXPECT_EQ(p.at(1e5).position, 1.7);
  EXPECT_EQ(p.at(1e5).velocity, 0.0);
}

// 0.02 m at 2 m/s2: the velocity turns at 0.2 m/s after 0.1 s.
TEST(Motion, ShortTrapezoidIsATriangle) {
  const auto p = make({kTrapezoidal, 0.5, 2.0, 0, 0.0, -0.02, 0.0, 0.0, false});
  EXPECT_NEAR(p.move_duration_s(), 0.2, 1e-15);
  expect_setpoint(p.at(0.05), -0.0025, -0.1, -2.0);
  EXPECT_NEAR(p.at(0.1).position, -0.01, 1e-15);
  EXPECT_NEAR(p.at(0.1).velocity, -0.2, 1e-15);
  expect_setpoint(p.at(0.15), -0.0175, -0.1, 2.0);
}

// The carts of the source start abruptly: at rest, then 0.06 m/s.
TEST(Motion, LargeAccelerationIsAnAbruptStart) {
  const auto p = make({kTrapezoidal, 0.06, 1e6, 0, 0.38, 1.6, 0.5, 0.0, false});
  EXPECT_EQ(p.at(0.499).velocity, 0.0);
  EXPECT_EQ(p.at(0.501).velocity, 0.06);
  EXPECT_NEAR(p.at(1.5).position, 0.44, 1e-8);
}

// A move that cruises for longer than a/jerk is the trapezoid averaged over the past a/jerk seconds.
TEST(Motion, LongSCurveIsTheAveragedTrapezoid) {
  const double v = 0.5;
  const double a = 2.0;
  const double w = a / 16.0;
  const auto p = make({kSCurve, v, a, 16.0, 0.0, 1.6, 0.0, 0.0, false});
  EXPECT_NEAR(p.move_duration_s(), 1.6 / v + v / a + w, 1e-14);
  const auto trapezoid = [=](double t) {  // position; 3.45 s in all
    const auto start = [=](double s) { return s < v / a ? 0.5 * a * s * s : v * (s - 0.5 * v / a); };
    if (t <= 0.0) return 0.0;
    if (t >= 3.45) return 1.6;
    return t < 1.725 ? start(t) : 1.6 - start(3.45 - t);
  };
  constexpr int kPoints = 2000;
  for (int i = 0; i <= 400; ++i) {
    const double t = i * 0.01 - 0.1;
    double mean = 0.0;
    for (int n = 0; n < kPoints; ++n) mean += trapezoid(t - w * (n + 0.5) / kPoints) / kPoints;
    EXPECT_NEAR(p.at(t).position, mean, 1e-9) << t;
    EXPECT_NEAR(p.at(t).velocity, (trapezoid(t) - trapezoid(t - w)) / w, 1e-12) << t;
  }
}

// Without velocity and acceleration limits rest to rest takes (32 D/jerk)^(1/3): jerk +, -, -, + for D = 4
// jerk (T/4)³ / 2.
TEST(Motion, ShortestSCurveIsAllJerk) {
  const auto p = make({kSCurve, 10.0, 10.0, 4.0, 0.0, 1.0, 0.0, 0.0, false});
  EXPECT_NEAR(p.move_duration_s(), 2.0, 1e-14);
  expect_setpoint(p.at(0.25), 4.0 / 6.0 / 64.0, 0.125, 1.0);
  EXPECT_NEAR(p.at(0.5).acceleration, 2.0, 1e-14);
  EXPECT_NEAR(p.at(1.0).velocity, 1.0, 1e-14);
  EXPECT_NEAR(p.at(1.0).position, 0.5, 1e-14);
  EXPECT_NEAR(p.at(1.0).acceleration, 0.0, 1e-13);
  expect_setpoint(p.at(1.75), 1.0 - 4.0 / 6.0 / 64.0, 0.125, -1.0);
}

// Times are whole binary fractions, so that a million cycles later the same values hold to the last bit.
TEST(Motion, RepeatsWithoutDrift) {
  const auto p = make({kTrapezoidal, 0.5, 2.0, 0, 0.25, 1.25, 0.5, 0.25, true});
  const double cycle = 0.5 + 2.25 + 0.25 + 2.25;
  for (int i = 0; i < 6 * 64; ++i) {
    const auto first = p.at(i / 64.0);
    const auto late = p.at(i / 64.0 + 1e6 * cycle);
    EXPECT_EQ(first.position, late.position);
    EXPECT_EQ(first.velocity, late.velocity);
    EXPECT_EQ(first.acceleration, late.acceleration);
  }
  EXPECT_EQ(p.at(2.75).position, 1.25);
  EXPECT_EQ(p.at(2.99).position, 1.25);
  EXPECT_LT(p.at(4.0).velocity, 0.0);
  EXPECT_EQ(p.at(cycle).position, 0.25);
  EXPECT_EQ(p.at(cycle + 0.49).velocity, 0.0);
  EXPECT_GT(p.at(cycle + 0.6).velocity, 0.0);
}

TEST(Motion, TellsWhereItGets) {
  const auto p = make({kTrapezoidal, 0.5, 2.0, 0, 1.25, 0.25, 0.5, 0.25, true});
  EXPECT_EQ(p.reached(0.4).lowest, 1.25);
  EXPECT_EQ(p.reached(0.4).highest, 1.25);
  EXPECT_EQ(p.reached(1.0).lowest, p.at(1.0).position);
  EXPECT_EQ(p.reached(1.0).highest, 1.25);
  EXPECT_EQ(p.reached(4.0).lowest, 0.25);  // on the way back
  EXPECT_EQ(p.reached(1e9).lowest, 0.25);
}

// ---- properties ---------------------------------------------------------------------------------------

rc::Gen<double> between(double low, double high) {
  return rc::gen::map(rc::gen::inRange(0, 1001),
                      [=](int i) { return low * std::pow(high / low, static_cast<double>(i) / 1000.0); });
}

MotionConfig random_move() {
  MotionConfig c;
  c.kind = *rc::gen::element(kTrapezoidal, kSCurve);
  c.velocity = *between(0.01, 100.0);
  c.acceleration = *between(0.01, 1000.0);
  c.jerk = *between(0.01, 1e5);
  c.from = *rc::gen::element(0.0, -3.0, 0.37);
  c.to = c.from + *between(0.001, 100.0) * *rc::gen::element(1.0, -1.0);
  c.wait_s = *rc::gen::element(0.0, 0.3);
  c.dwell_s = *rc::gen::element(0.0, 0.2);
  c.returns = *rc::gen::arbitrary<bool>();
  return c;
}

/// Least time of the move: the turning velocity found by bisection in the distance that two ramps take.
double least_time(const MotionConfig& c) {
  const double distance = std::abs(c.to - c.from);
  const bool smooth = c.kind == kSCurve;
  const double lag = smooth ? c.acceleration / c.jerk : 0.0;
  const auto ramp = [&](double v) {
    return v >= c.acceleration * lag ? v / c.acceleration + lag : 2.0 * std::sqrt(v / c.jerk);
  };
  double low = 0.0;
  double high = c.velocity;
  if (high * ramp(high) > distance)
    for (int i = 0; i < 200; ++i) {
      const double mid = 0.5 * (low + high);
      (mid * ramp(mid) > distance ? high : low) = mid;
    }
  return ramp(high) + distance / high;
}

/// Walks through one and a half cycles; every interval obeys the limits, and its way is the integral of the
/// velocity by Simpson's rule, exact but where the acceleration (its slope, with limited jerk) steps.
void walk(const MotionConfig& c, const MotionProfile& p) {
  constexpr int kIntervals = 6000;
  const double move_s = p.move_duration_s();
  const double h = 1.5 * (c.wait_s + c.dwell_s + 2.0 * move_s) / kIntervals;
  const double scale = std::abs(c.from) + std::abs(c.to);
  const bool smooth = c.kind == kSCurve;
  const double kink = smooth ? c.jerk * h * h * h : c.acceleration * h * h;
  const auto [low, high] = std::minmax(c.from, c.to);
  int kinks = 0;
  Setpoint a = p.at(0.0);
  for (int i = 0; i < kIntervals; ++i) {
    const Setpoint m = p.at((i + 0.5) * h);
    const Setpoint b = p.at((i + 1) * h);
    RC_ASSERT(b.position >= low && b.position <= high);
    RC_ASSERT(std::abs(b.velocity) <= c.velocity * (1.0 + 1e-12));
    RC_ASSERT(std::abs(b.acceleration) <= c.acceleration * (1.0 + 1e-12));
    RC_ASSERT(std::abs(b.velocity - a.velocity) <= c.acceleration * h * (1.0 + 1e-9) + 1e-12 * c.velocity);
    if (smooth)
      RC_ASSERT(std::abs(b.acceleration - a.acceleration) <=
                c.jerk * h * (1.0 + 1e-9) + 1e-12 * c.acceleration);
    const double way = h * (a.velocity + 4.0 * m.velocity + b.velocity) / 6.0;
    const double error = std::abs(b.position - a.position - way);
    const double rounding = 1e-14 * scale + 1e-12 * c.velocity * h;
    RC_ASSERT(error <= kink + rounding);
    if (error > rounding) ++kinks;
    a = b;
  }
  RC_ASSERT(kinks <= 8 * 3 + 6);  // 8 a move, 3 moves
}

TEST(Motion, ObeysItsLimitsAndMeetsItsEnds) {
  ::setenv("RC_PARAMS", "seed=20160617 max_success=300", 0);
  EXPECT_TRUE(rc::check("limits, continuity, ends, least time", [] {
    const MotionConfig c = random_move();
    RC_LOG() << "kind " << static_cast<int>(c.kind) << " v " << c.velocity << " a " << c.acceleration << " j "
             << c.jerk << " from " << c.from << " to " << c.to << "\n";
    const auto p = make(c);
    const double move_s = p.move_duration_s();
    RC_ASSERT(std::abs(move_s / least_time(c) - 1.0) < 1e-12);
    RC_ASSERT(p.at(0.0).position == c.from);
    RC_ASSERT(p.at(c.wait_s).position == c.from);
    RC_ASSERT(p.at(c.wait_s).velocity == 0.0);
    const double arrival = c.wait_s + move_s;
    if (c.dwell_s > 0.0 || !c.returns) RC_ASSERT(p.at(arrival + 0.5 * c.dwell_s).position == c.to);
    RC_ASSERT(std::abs(p.at(arrival).position - c.to) <= 1e-14 * (std::abs(c.from) + std::abs(c.to)));
    walk(c, p);
  }));
}

TEST(Motion, IsConvolvedWithAShaper) {
  MotionConfig c{kSCurve, 0.5, 2.0, 16.0, 0.25, 1.5, 0.1, 0.2, true};
  const auto plain = make(c);
  c.shaper_amplitudes = {0.6, 0.4};
  c.shaper_times_s = {0.0, 0.07};
  const auto shaped = make(c);
  for (int k = 0; k < 500; ++k) {
    const double t = 0.02 * k;
    const Setpoint now = plain.at(t), before = plain.at(t - 0.07), s = shaped.at(t);
    EXPECT_NEAR(s.position, 0.6 * now.position + 0.4 * before.position, 1e-12) << t;
    EXPECT_NEAR(s.velocity, 0.6 * now.velocity + 0.4 * before.velocity, 1e-12) << t;
    EXPECT_NEAR(s.acceleration, 0.6 * now.acceleration + 0.4 * before.acceleration, 1e-12) << t;
  }
  EXPECT_EQ(shaped.move_duration_s(), plain.move_duration_s());
  EXPECT_NEAR(shaped.at(0.1 + plain.move_duration_s() + 0.07 + 0.05).position, 1.5, 1e-12);  // at rest there
}

// ---- configuration ------------------------------------------------------------------------------------

TEST(Motion, NamesTheFieldThatIsWrong) {
  const auto field = [](auto change) {
    MotionConfig c{kSCurve, 0.5, 2.0, 16.0, 0.0, 1.0, 0.0, 0.0, true};
    change(c);
    const auto result = MotionProfile::create(c);
    return result ? std::string("accepted") : std::string(result.error().field);
  };
  EXPECT_EQ(field([](auto&) {}), "accepted");
  EXPECT_EQ(field([](auto& c) { c.velocity = -0.5; }), "velocity");
  EXPECT_EQ(field([](auto& c) { c.velocity = INFINITY; }), "velocity");
  EXPECT_EQ(field([](auto& c) { c.acceleration = 0.0; }), "acceleration");
  EXPECT_EQ(field([](auto& c) { c.jerk = 0.0; }), "jerk");
  EXPECT_EQ(field([](auto& c) { c.kind = kTrapezoidal, c.jerk = 0.0; }), "accepted");
  EXPECT_EQ(field([](auto& c) { c.to = c.from; }), "to");
  EXPECT_EQ(field([](auto& c) { c.from = NAN; }), "from");
  EXPECT_EQ(field([](auto& c) { c.wait_s = -1.0; }), "wait_s");
  EXPECT_EQ(field([](auto& c) { c.dwell_s = -1.0; }), "dwell_s");
  EXPECT_EQ(field([](auto& c) { c.kind = MotionKind::constant, c.velocity = NAN; }), "velocity");
  const auto shaper = [&](std::vector<double> amplitudes, std::vector<double> times_s) {
    return field([&](auto& c) { c.shaper_amplitudes = amplitudes, c.shaper_times_s = times_s; });
  };
  EXPECT_EQ(shaper({0.5, 0.5}, {0.0, 0.03}), "accepted");
  EXPECT_EQ(shaper({0.5, 0.5}, {0.0}), "shaper_times_s");
  EXPECT_EQ(shaper({0.5, 0.5}, {0.0, -0.03}), "shaper_times_s");
  EXPECT_EQ(shaper({0.5, 0.4}, {0.0, 0.03}), "shaper_amplitudes");
  EXPECT_EQ(shaper({1.5, -0.5}, {0.0, 0.03}), "shaper_amplitudes");
}

TEST(Motion, DescribesTheFieldsOfEachKind) {
  const auto fields = [](MotionKind kind) {
    MotionConfig c;
    c.kind = kind;
    std::string names;
    describe([&names](std::string_view name, auto&, std::string_view) { names.append(name).append(" "); }, c);
    return names;
  };
  EXPECT_EQ(fields(MotionKind::standstill), "kind from ");
  EXPECT_EQ(fields(MotionKind::constant), "kind velocity from ");
  const std::string moves = "from to wait_s returns dwell_s shaper_amplitudes shaper_times_s ";
  EXPECT_EQ(fields(kTrapezoidal), "kind velocity acceleration " + moves);
  EXPECT_EQ(fields(kSCurve), "kind velocity acceleration jerk " + moves);
  EXPECT_EQ(name_of(kSCurve), "s-curve");
}

}  // namespace
}  // namespace resonid::plant
