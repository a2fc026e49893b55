// SPDX-License-Identifier: MIT
// The loop before anything is identified, against docs/methods/tune.md 13 worked out by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <resonid/base/error_text.hpp>
#include <resonid/identification/first_loop.hpp>
#include <string>

namespace resonid::identification {
namespace {

FirstLoopOptions known() {
  FirstLoopOptions o;
  o.motor_inertia = 0.032;
  o.total_inertia = 0.064;
  o.sample_rate_hz = 500.0;
  o.delay_s = 0.004;
  return o;
}

TEST(FirstLoop, IsThatOfTheMotorsInertiaAndTheLag) {
  const auto loop = first_loop(known());
  ASSERT_TRUE(loop) << message_of(loop.error());
  // lag = 4 ms + 1 ms, w1 = pi 0.01/lag = 2 pi rad/s
  const double kp = 0.032 * 2.0 * std::numbers::pi, ki = kp * kp / (6.0 * 0.064);
  EXPECT_NEAR(loop->controller.gains->kp, kp, 1e-12);
  EXPECT_NEAR(loop->controller.gains->ki, ki, 1e-12);
  EXPECT_NEAR(loop->lag_s, 0.005, 1e-15);
  EXPECT_NEAR(loop->crossover_hz, 0.5, 1e-12);  // half the motor's inertia: half of w1
  EXPECT_EQ(loop->controller.structure, "pi");
  // kp + ki Ts z/(z - 1)
  ASSERT_EQ(loop->controller.feedback.numerator.size(), 2U);
  EXPECT_NEAR(loop->controller.feedback.numerator[0], kp + 0.002 * ki, 1e-12);
  EXPECT_NEAR(loop->controller.feedback.numerator[1], -kp, 1e-12);
  EXPECT_NEAR(loop->controller.feedback.denominator[1], -1.0, 1e-12);
}

TEST(FirstLoop, TakesTheSmallestMotorWhereOnlyTheTotalIsKnown) {
  auto o = known();
  o.motor_inertia.reset();
  o.largest_ratio = 9.0;
  o.torque_lag_s = 0.005;
  const auto loop = first_loop(o);
  ASSERT_TRUE(loop) << message_of(loop.error());
  EXPECT_NEAR(loop->controller.gains->kp, 0.0064 * std::numbers::pi, 1e-12);  // lag 10 ms
}

TEST(FirstLoop, IsExportedWithItsLimit) {
  auto o = known();
  o.torque_limit = 2.5;
  const auto loop = first_loop(o);
  ASSERT_TRUE(loop);
  for (const auto format :
       {ExportFormat::c, ExportFormat::c_float, ExportFormat::structured_text, ExportFormat::hal}) {
    const auto text = exported(*loop, format, {"first", "x", "servo-thread"});
    ASSERT_TRUE(text) << message_of(text.error());
    EXPECT_NE(text->find("first"), std::string::npos);
    EXPECT_NE(text->find("2.5"), std::string::npos);
  }
  EXPECT_EQ(exported(*loop, ExportFormat::klipper).error().field, "format");
}

TEST(FirstLoop, RefusesWhatItCannotWorkFrom) {
  const auto field = [](auto change) {
    auto o = known();
    change(o);
    const auto loop = first_loop(o);
    return loop ? std::string() : std::string(loop.error().field);
  };
  EXPECT_EQ(field([](auto& o) { o.sample_rate_hz = 0.0; }), "sample_rate_hz");
  EXPECT_EQ(field([](auto& o) { o.delay_s = -1.0; }), "delay_s");
  EXPECT_EQ(field([](auto& o) { o.motor_inertia = -1.0; }), "motor_inertia");
  EXPECT_EQ(field([](auto& o) { o.motor_inertia.reset(); }), "motor_inertia");
  EXPECT_EQ(field([](auto& o) { o.total_inertia = 0.01; }), "total_inertia");
  EXPECT_EQ(field([](auto& o) { o.total_inertia.reset(); }), "total_inertia");
  EXPECT_EQ(field([](auto& o) { o.least_damping = 0.5; }), "least_damping");
  EXPECT_EQ(field([](auto& o) { o.torque_limit = 0.0; }), "torque_limit");
  EXPECT_EQ(field([](auto&) {}), "");
}

}  // namespace
}  // namespace resonid::identification
