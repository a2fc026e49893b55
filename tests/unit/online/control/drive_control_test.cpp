// SPDX-License-Identifier: MIT
// The law against its difference equations, worked out here in extended precision, and against analytic
// values.
#include <gtest/gtest.h>

#include <allocation_counter.hpp>
#include <complex>
#include <cstring>
#include <new>
#include <resonid/online/control.hpp>
#include <string>

#include "direct_law.hpp"

namespace resonid::online {
namespace {

using test::DirectBiquad;
using test::filtered_config;
using test::kRate;
using test::Noise;
using test::plain_config;
using test::velocity_inputs;

template <class Real>
class DriveControlOf : public testing::Test {
 protected:
  static constexpr double kTolerance = std::is_same_v<Real, float> ? 5e-5 : 1e-13;
};
using Reals = testing::Types<double, float>;
TYPED_TEST_SUITE(DriveControlOf, Reals);

TYPED_TEST(DriveControlOf, IsItsDifferenceEquations) {
  using Real = TypeParam;
  DriveControlConfig config = filtered_config();
  config.set_point_weight = 0.4;
  auto control = DriveControl<Real>::create(config).value();
  DirectBiquad first(test::kFilters[0], kRate), second(test::kFilters[1], kRate);
  Noise noise(3);
  long double errors = 0.0L, largest = 0.0L, apart = 0.0L;
  for (int k = 0; k < 3000; ++k) {
    const double r = k < 100 ? 0.0 : k < 1500 ? 8.0 : -3.0;
    const auto y = static_cast<double>(static_cast<Real>(0.3 * noise() + 0.9 * r));
    const double feed = k % 700 == 0 ? 0.5 : 0.0;
    errors += static_cast<long double>(r) - y;
    const long double inner = 0.6L * (0.4L * r - y) + 25.0L / kRate * errors;
    const long double truth = second.step(first.step(inner)) + feed;
    auto inputs = velocity_inputs<Real>(r, y);
    inputs.torque_feed_forward = static_cast<Real>(feed);
    inputs.position = inputs.velocity_feed_forward = static_cast<Real>(NAN);  // not in use
    const auto torque = static_cast<long double>(control.step(inputs));
    largest = std::max(largest, std::abs(truth));
    apart = std::max(apart, std::abs(torque - truth));
  }
  EXPECT_GT(largest, 10.0L);
  EXPECT_LT(static_cast<double>(apart / largest), this->kTolerance);
  EXPECT_EQ(control.samples(), 3000U);
  EXPECT_EQ(control.skipped_samples(), 0U);
}

/// At its own frequency a biquad is zn/zd, whatever the sample rate: analytic, by a sine that has settled.
TYPED_TEST(DriveControlOf, FiltersAreRightAtTheirOwnFrequency) {
  using Real = TypeParam;
  for (const double hz : {20.0, 125.0, 400.0}) {
    const std::array<Biquad, 1> filter{{{hz, 0.1, 0.7}}};
    DriveControlConfig config = plain_config();
    config.kp = 1.0;
    config.ki = 0.0;
    config.biquads = filter;
    auto control = DriveControl<Real>::create(config).value();
    std::complex<double> sum;
    for (int k = 0; k < 4000; ++k) {
      const double phase = kTwoPi * std::fmod(hz / kRate * k, 1.0);
      const auto torque = static_cast<double>(control.step(velocity_inputs<Real>(std::cos(phase), 0.0)));
      if (k >= 2000) sum += torque * std::polar(1.0, -phase) / 1000.0;
    }
    EXPECT_LT(std::abs(sum - 0.1 / 0.7), 100.0 * this->kTolerance) << hz;
  }
}

/// Position loop: r = kv (x_r - x) + v, with a measured position or the sum of the velocity.
TYPED_TEST(DriveControlOf, IsACascadeOverAMeasuredOrASummedPosition) {
  using Real = TypeParam;
  for (const bool sums : {false, true}) {
    DriveControlConfig config = filtered_config();
    config.kv = 12.0;
    config.sums_velocity = sums;
    auto control = DriveControl<Real>::create(config).value();
    DirectBiquad first(test::kFilters[0], kRate), second(test::kFilters[1], kRate);
    Noise noise(11);
    long double errors = 0.0L, position = 0.0L, largest = 0.0L, apart = 0.0L;
    for (int k = 0; k < 2000; ++k) {
      const double target = 1.0 - std::cos(0.003 * k), speed = 3.0 * std::sin(0.003 * k);
      const auto y = static_cast<double>(static_cast<Real>(speed + 0.2 * noise()));
      position += y / kRate;
      const long double reference = 12.0L * (target - position) + speed;
      errors += reference - y;
      const long double inner = 0.6L * (reference - y) + 25.0L / kRate * errors;
      const long double truth = second.step(first.step(inner)) + 0.1L;
      const ControlInputs<Real> inputs{static_cast<Real>(target), static_cast<Real>(y),
                                       sums ? static_cast<Real>(NAN) : static_cast<Real>(position),
                                       static_cast<Real>(speed), Real(0.1)};
      const auto torque = static_cast<long double>(control.step(inputs));
      largest = std::max(largest, std::abs(truth));
      apart = std::max(apart, std::abs(torque - truth));
      EXPECT_NEAR(static_cast<double>(control.velocity_reference()), static_cast<double>(reference), 1e-4);
    }
    EXPECT_LT(static_cast<double>(apart / largest), this->kTolerance) << sums;
  }
}

/// A million steps of 1e-5 at 1000: a plain sum of floats, whose grid is 6e-5 there, would not move at all.
TEST(DriveControl, ASummedPositionInFloatKeepsSmallSteps) {
  DriveControlConfig config = plain_config();
  config.kv = 1.0;
  config.sums_velocity = true;
  auto control = DriveControl<float>::create(config).value();
  control.set_position(1000.0F);
  for (int k = 0; k < 1000000; ++k) control.step(velocity_inputs<float>(1000.0, 0.01));
  EXPECT_NEAR(control.position(), 1010.0F, 1e-3F);
}

/// Linear between nodes and constant beyond them, by hand.
TYPED_TEST(DriveControlOf, InterpolatesItsSchedule) {
  using Real = TypeParam;
  constexpr std::array<GainNode, 3> kNodes{{{-1.0, 1.0, 10.0}, {0.0, 2.0, 30.0}, {2.0, 6.0, 20.0}}};
  DriveControlConfig config = plain_config();
  config.kp = config.ki = 0.0;
  config.schedule = kNodes;
  auto control = DriveControl<Real>::create(config).value();
  struct Place {
    double position, kp, ki;
  };
  for (const Place& place :
       {Place{-5.0, 1.0, 10.0}, Place{-1.0, 1.0, 10.0}, Place{-0.25, 1.75, 25.0}, Place{0.0, 2.0, 30.0},
        Place{1.0, 4.0, 25.0}, Place{2.0, 6.0, 20.0}, Place{1e6, 6.0, 20.0}}) {
    auto inputs = velocity_inputs<Real>(0.0, 0.0);
    inputs.position = static_cast<Real>(place.position);
    control.step(inputs);
    EXPECT_NEAR(static_cast<double>(control.kp()), place.kp, 1e-6) << place.position;
    EXPECT_NEAR(static_cast<double>(control.ki()), place.ki, 1e-5) << place.position;
  }
}

TYPED_TEST(DriveControlOf, TakesNoHeapAndResetsBitForBit) {
  using Real = TypeParam;
  DriveControlConfig config = filtered_config();
  config.torque_limit = 3.0;
  const std::size_t before = test::allocations();
  auto control = DriveControl<Real>::create(config).value();
  const auto run = [&control] {
    Noise noise(5);
    Real last = Real(0);
    for (int k = 0; k < 500; ++k) last = control.step(velocity_inputs<Real>(k < 100 ? 9.0 : 0.0, noise()));
    return last;
  };
  const Real first = run();
  EXPECT_NE(run(), first);
  control.reset();
  EXPECT_EQ(run(), first);
  ASSERT_TRUE(control.exchange_filters({}, 10, 10));
  ASSERT_TRUE(control.set_gains(1.0, 2.0));
  run();
  EXPECT_EQ(test::allocations(), before);
  const auto copy = control;
  EXPECT_TRUE(copy.intact());
}

TEST(DriveControl, RefusesWhatIsNoController) {
  constexpr std::array<GainNode, 2> kNodes{{{0.0, 1.0, 10.0}, {1.0, 2.0, 30.0}}};
  const auto refused = [](auto change) {
    DriveControlConfig config = plain_config();
    change(config);
    const auto made = DriveControl<double>::create(config);
    return made ? std::string() : made.error().field.str();
  };
  EXPECT_EQ(refused([](auto&) {}), "");
  EXPECT_EQ(refused([](auto& c) { c.sample_rate_hz = 0.0; }), "sample_rate_hz");
  EXPECT_EQ(refused([](auto& c) { c.sample_rate_hz = INFINITY; }), "sample_rate_hz");
  EXPECT_EQ(refused([](auto& c) { c.kp = -1.0; }), "kp");
  EXPECT_EQ(refused([](auto& c) { c.ki = NAN; }), "ki");
  EXPECT_EQ(refused([](auto& c) { c.set_point_weight = 1.1; }), "set_point_weight");
  EXPECT_EQ(refused([](auto& c) { c.torque_limit = 0.0; }), "torque_limit");
  EXPECT_EQ(refused([](auto& c) { c.kv = -1.0; }), "kv");
  EXPECT_EQ(refused([](auto& c) {
              c.kv = 3.0;
              c.set_point_weight = 0.5;
            }),
            "set_point_weight");
  EXPECT_EQ(refused([&](auto& c) { c.schedule = kNodes; }), "kp");
  EXPECT_EQ(refused([&](auto& c) {
              c.kp = 0.0;
              c.schedule = kNodes;
            }),
            "ki");
  std::array<GainNode, 18> nodes{};
  const auto with_nodes = [&](std::size_t count) {
    return refused([&](auto& c) {
      c.kp = c.ki = 0.0;
      c.schedule = std::span(nodes).first(count);
    });
  };
  for (std::size_t i = 0; i < nodes.size(); ++i) nodes[i] = {static_cast<double>(i), 1.0, 1.0};
  EXPECT_EQ(with_nodes(17), "");
  EXPECT_EQ(with_nodes(18), "schedule");
  nodes[3].position = 2.0;
  EXPECT_EQ(with_nodes(17), "schedule");
  nodes[3] = {3.0, -1.0, 1.0};
  EXPECT_EQ(with_nodes(17), "schedule");
  std::array<Biquad, 5> biquads;
  biquads.fill({50.0, 0.1, 0.5});
  const auto with_biquads = [&](std::size_t count) {
    return refused([&](auto& c) { c.biquads = std::span(biquads).first(count); });
  };
  EXPECT_EQ(with_biquads(4), "");
  EXPECT_EQ(with_biquads(5), "biquads");
  for (const Biquad& bad : {Biquad{500.0, 0.1, 0.5}, Biquad{0.0, 0.1, 0.5}, Biquad{50.0, -0.1, 0.5},
                            Biquad{50.0, 0.1, 0.0}, Biquad{NAN, 0.1, 0.5}}) {
    biquads[1] = bad;
    EXPECT_EQ(with_biquads(2), "biquads");
  }
}

/// The error of rounded coefficients against its maximum over 20000 frequencies.
TEST(DriveControl, RefusesFloatsThatLoseAFilter) {
  for (const double share : {0.1, 0.01, 0.003, 0.001, 0.0004, 1e-4}) {
    for (const double damping : {0.05, 0.3, 1.0}) {
      const Biquad biquad{share * kRate, 0.3 * damping, damping};
      const auto c = coefficients_of(biquad, kRate);
      const auto round = [](double x) { return static_cast<double>(static_cast<float>(x)); };
      const auto at = [](double b0, double b1, double b2, double a1, double a2, std::complex<double> z) {
        return (b0 + z * (b1 + z * b2)) / (1.0 + z * (a1 + z * a2));
      };
      double largest = 0.0;
      for (int i = 0; i <= 20000; ++i) {
        const auto z = std::polar(1.0, -kPi * std::pow(10.0, -7.0 * i / 20000.0));
        const auto exact = at(c.b0, c.b1, c.b2, c.a1, c.a2, z);
        const auto rounded = at(round(c.b0), round(c.b1), round(c.b2), round(c.a1), round(c.a2), z);
        largest = std::max(largest, std::abs(rounded / exact - 1.0));
      }
      EXPECT_GT(float_error(c), 0.6 * largest) << share << ' ' << damping;
      EXPECT_LE(float_error(c), 1.02 * largest) << share << ' ' << damping;
    }
  }
  DriveControlConfig config = plain_config();
  const std::array<Biquad, 1> slow{{{0.3, 0.1, 0.5}}};
  config.biquads = slow;
  EXPECT_TRUE(DriveControl<double>::create(config));
  EXPECT_EQ(DriveControl<float>::create(config).error().field, "biquads");
}

/// What no steps can leave is seen.
TEST(DriveControl, SeesStatesThatCannotBe) {
  const auto control = DriveControl<double>::create(filtered_config()).value();
  std::array<unsigned char, sizeof control> bytes;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    std::memcpy(bytes.data(), &control, sizeof control);
    bytes[i] = 0xFF;
    alignas(DriveControl<double>) std::array<unsigned char, sizeof control> copy = bytes;
    if (!std::launder(reinterpret_cast<const DriveControl<double>*>(copy.data()))->intact()) ++seen;
  }
  EXPECT_GT(seen, 8U);  // five flags, three counts
}

}  // namespace
}  // namespace resonid::online
