// SPDX-License-Identifier: MIT
// At the limit of the torque: the sum does not wind up.
#include <gtest/gtest.h>

#include <resonid/online/control.hpp>

#include "direct_law.hpp"

namespace resonid::online {
namespace {

using test::kRate;
using test::velocity_inputs;

constexpr double kLimit = 2.0, kInertia = 0.05;

DriveControlConfig limited_config() {
  DriveControlConfig config = test::filtered_config();
  config.torque_limit = kLimit;
  return config;
}

/// PI with filters as in limited_config(), written out here, with the sum of one's choice at the limit.
class Reference {
 public:
  enum class AtLimit { winds_up, back_calculates };
  explicit Reference(AtLimit rule) : rule_(rule) {}
  double step(double r, double y) {
    const double proportional = 0.6 * (r - y);
    sum_ += 25.0 / kRate * (r - y);
    const auto u = static_cast<double>(second_.step(first_.step(proportional + sum_)));
    if (std::abs(u) <= kLimit) return u;
    const double limited = std::clamp(u, -kLimit, kLimit);
    if (rule_ == AtLimit::back_calculates) sum_ = limited - proportional;  // docs/methods/tune.md 16.1
    return limited;
  }

 private:
  AtLimit rule_;
  double sum_ = 0.0;
  test::DirectBiquad first_{test::kFilters[0], kRate}, second_{test::kFilters[1], kRate};
};

/// A shaft that is blocked for three seconds while its loop asks for 1 rad/s, and then set free.
template <class Step>
double overshoot_after_a_stall(Step&& step) {
  double velocity = 0.0, largest = 0.0;
  for (int k = 0; k < 8000; ++k) {
    const double torque = step(1.0, velocity);
    EXPECT_LE(std::abs(torque), kLimit);
    velocity = k < 3000 ? 0.0 : velocity + torque / kInertia / kRate;
    largest = std::max(largest, velocity);
  }
  EXPECT_NEAR(velocity, 1.0, 1e-3);
  return largest - 1.0;
}

TEST(TorqueLimit, RecoversAsWellAsBackCalculation) {
  auto control = DriveControl<double>::create(limited_config()).value();
  Reference winding(Reference::AtLimit::winds_up), calculated(Reference::AtLimit::back_calculates);
  const double found = overshoot_after_a_stall(
      [&](double r, double y) { return control.step(velocity_inputs<double>(r, y)); });
  const double back = overshoot_after_a_stall([&](double r, double y) { return calculated.step(r, y); });
  const double wound = overshoot_after_a_stall([&](double r, double y) { return winding.step(r, y); });
  EXPECT_LE(found, 1.001 * back) << wound;
  EXPECT_GT(back, 0.0);
  EXPECT_GT(wound, 3.0 * found);  // what the limit would do to a sum that goes on
}

/// With a step that saturates at once, the limited loop overshoots no more than the linear one.
TEST(TorqueLimit, AStepThatSaturatesOvershootsNoMoreThanALinearOne) {
  DriveControlConfig linear = limited_config();
  linear.torque_limit = std::numeric_limits<double>::infinity();
  const auto overshoot = [](const DriveControlConfig& config) {
    auto control = DriveControl<double>::create(config).value();
    double velocity = 0.0, largest = 0.0;
    for (int k = 0; k < 4000; ++k) {
      velocity += control.step(velocity_inputs<double>(50.0, velocity)) / kInertia / kRate;
      largest = std::max(largest, velocity);
    }
    EXPECT_NEAR(velocity, 50.0, 0.5);
    return largest / 50.0 - 1.0;
  };
  EXPECT_GT(overshoot(linear), 0.1);
  EXPECT_LE(overshoot(limited_config()), overshoot(linear));
}

/// The sum stands while the error drives the torque out, and moves as soon as it drives it in.
TEST(TorqueLimit, HoldsTheSumOnlyOutwards) {
  DriveControlConfig config = limited_config();
  config.biquads = {};
  auto control = DriveControl<double>::create(config).value();
  control.step(velocity_inputs<double>(1.0, 0.0));
  EXPECT_FALSE(control.limited());
  EXPECT_DOUBLE_EQ(control.integral(), 0.025);
  EXPECT_EQ(control.step(velocity_inputs<double>(100.0, 0.0)), kLimit);
  EXPECT_TRUE(control.limited());
  EXPECT_DOUBLE_EQ(control.integral(), 0.025);
  auto inputs = velocity_inputs<double>(-1.0, 0.0);
  inputs.torque_feed_forward = 10.0;  // out by what is fed forward, in by the error
  EXPECT_EQ(control.step(inputs), kLimit);
  EXPECT_DOUBLE_EQ(control.integral(), 0.0);
  EXPECT_EQ(control.step(velocity_inputs<double>(-100.0, 0.0)), -kLimit);
  EXPECT_DOUBLE_EQ(control.integral(), 0.0);
  EXPECT_EQ(control.torque(), -kLimit);
}

/// The feed-forward counts in the limit.
TEST(TorqueLimit, CutsTheTorqueWithItsFeedForward) {
  auto control = DriveControl<float>::create(limited_config()).value();
  auto inputs = velocity_inputs<float>(0.0, 0.0);
  inputs.torque_feed_forward = -5.0F;
  EXPECT_EQ(control.step(inputs), -2.0F);
}

}  // namespace
}  // namespace resonid::online
