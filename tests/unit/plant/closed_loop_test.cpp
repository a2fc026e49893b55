// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <golden.hpp>
#include <resonid/plant/closed_loop.hpp>

namespace resonid::plant {
namespace {

// System 2 of Publication VI and the PI that gives 2.7 Hz and 63.5 deg with 4 ms delay
// (tests/golden/README.md).
const DriveConfig kSystem2{Structure::two_mass, data::Motion::rotary, 0.032, 0.032, 5.75e4, 120.0, 0.05, 0.0};
constexpr double kRate = 500.0;

ControllerConfig golden_controller() {
  ControllerConfig c;
  c.kind = ControllerKind::pi;
  c.gain = 1.03598193204;
  c.integral_time_s = 0.147023908851;
  return c;
}

ClosedLoop make_loop(const DriveConfig& drive, const ControllerConfig& controller, double delay_s,
                     double reference) {
  const auto delay = split_delay(delay_s, kRate);
  return ClosedLoop(make_drive({drive, {}, {}, 0.0}, kRate, delay.fraction).value(),
                    {Controller::create(controller, kRate).value(),
                     MotionProfile::create({MotionKind::constant, reference}).value(), delay,
                     VelocitySource::sensor, 0.0, 0.0, 1.0, 1.0 / kRate});
}

TEST(ClosedLoop, ReproducesTheNoiseFreeGoldenRecords) {
  for (const char* file : {"b_chirp_sys2.csv", "c_multisine_A.csv", "c_multisine_B.csv"}) {
    DriveConfig drive = kSystem2;
    if (std::string(file) == "c_multisine_B.csv") {
      drive.stiffness = 3.10e4;
      drive.damping = 90.0;
    }
    const auto ru = test::golden_column(file, "ru");
    const auto u = test::golden_column(file, "u_clean");
    const auto y = test::golden_column(file, "y_clean");
    auto loop = make_loop(drive, golden_controller(), 0.004, 0.0);
    for (std::size_t k = 0; k < ru.size(); ++k) {
      const auto s = loop.step(ru[k], 0.0);
      ASSERT_NEAR(s.input, u[k], 3e-8) << file << " sample " << k;
      ASSERT_NEAR(s.output, y[k], 3e-8) << file << " sample " << k;
    }
  }
}

// The noise of the golden record is what its output holds beyond the response to its input; fed into the loop
// it must give back both columns, which it does only when it goes round the loop as docs/notation.md says.
TEST(ClosedLoop, ReproducesTheNoisyGoldenRecord) {
  const char* file = "b_chirp_sys2.csv";
  const auto ru = test::golden_column(file, "ru");
  const auto u = test::golden_column(file, "u_noisy");
  const auto y = test::golden_column(file, "y_noisy");
  auto machine = make_drive({kSystem2, {}, {}, 0.0}, kRate, 0.0).value();
  std::vector<double> velocity{0.0, 0.0, 0.0};
  for (const double torque : u) velocity.push_back(machine->advance(torque).velocity);
  auto loop = make_loop(kSystem2, golden_controller(), 0.004, 0.0);
  double power = 0.0;
  for (std::size_t k = 0; k < ru.size(); ++k) {
    const double noise = y[k] - velocity[k];
    power += noise * noise;
    const auto s = loop.step(ru[k], noise);
    ASSERT_NEAR(s.input, u[k], 1e-6) << "sample " << k;
    ASSERT_NEAR(s.output, y[k], 1e-6) << "sample " << k;
  }
  EXPECT_NEAR(std::sqrt(power / static_cast<double>(ru.size())), 0.1, 0.003);
}

TEST(ClosedLoop, SplitsDelays) {
  EXPECT_EQ(split_delay(0.004, 500.0).whole, 2U);
  EXPECT_EQ(split_delay(0.004, 500.0).fraction, 0.0);
  EXPECT_EQ(split_delay(0.0, 500.0).whole, 0U);
  EXPECT_EQ(split_delay(0.3, 10.0).whole, 3U);  // 0.3 * 10 is just below 3
  EXPECT_EQ(split_delay(0.0053, 500.0).whole, 2U);
  EXPECT_NEAR(split_delay(0.0053, 500.0).fraction, 0.65, 1e-12);
}

// A rigid machine without friction under constant torque turns at t/J: with the delay d the measurement is (t
// - d)/J.
TEST(ClosedLoop, DelaysByAnyTime) {
  const DriveConfig rigid{Structure::rigid, data::Motion::rotary, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0};
  for (const double delay : {0.0, 0.0005, 0.002, 0.0049, 0.0101}) {
    auto loop = make_loop(rigid, ControllerConfig{}, delay, 0.0);
    for (int k = 0; k < 50; ++k)
      EXPECT_NEAR(loop.step(1.0, 0.0).output, std::max(0.0, k / kRate - delay) / 0.5, 1e-13) << delay;
  }
}

TEST(ClosedLoop, StartsSettledAtTheReference) {
  DriveConfig drive = kSystem2;
  drive.viscous_friction = 0.04;
  auto loop = make_loop(drive, golden_controller(), 0.0047, 10.0);
  for (int k = 0; k < 2000; ++k) {
    const auto s = loop.step(0.0, 0.0);
    ASSERT_NEAR(s.output, 10.0, 1e-10);
    ASSERT_NEAR(s.input, 0.4, 1e-10);
  }
}

TEST(ClosedLoop, StartsSettledWithoutAnIntegrator) {
  DriveConfig drive = kSystem2;
  drive.viscous_friction = 0.25;
  ControllerConfig lag;  // gain 1 at 0 Hz
  lag.kind = ControllerKind::transfer_function;
  lag.numerator = {0.5, 0.25};
  lag.denominator = {1.0, -0.25};
  auto loop = make_loop(drive, lag, 0.002, 10.0);
  for (int k = 0; k < 500; ++k) ASSERT_NEAR(loop.step(0.0, 0.0).output, 8.0, 1e-10);  // 1 (10 - v) = 0.25 v
}

TEST(ClosedLoop, OpenLoopHoldsItsVelocityAndPassesTheExcitation) {
  DriveConfig drive = kSystem2;
  drive.viscous_friction = 0.04;
  auto loop = make_loop(drive, ControllerConfig{}, 0.0, 10.0);
  for (int k = 0; k < 100; ++k) ASSERT_NEAR(loop.step(0.0, 0.0).output, 10.0, 1e-11);
  EXPECT_NEAR(loop.step(1.0, 0.5).input, 1.4, 1e-12);
}

}  // namespace
}  // namespace resonid::plant
