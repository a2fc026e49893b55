// SPDX-License-Identifier: MIT
// Other filters in motion: run along, cross-faded, no state reset.
#include <gtest/gtest.h>

#include <resonid/online/control.hpp>
#include <vector>

#include "direct_law.hpp"

namespace resonid::online {
namespace {

using test::filtered_config;
using test::kRate;
using test::plain_config;
using test::velocity_inputs;

constexpr std::array<Biquad, 3> kOthers{{{71.0, 0.05, 0.9}, {33.0, 0.5, 0.4}, {300.0, 0.7, 1.0}}};

DriveControl<double> proportional(std::span<const Biquad> biquads) {
  DriveControlConfig config = plain_config();
  config.ki = 0.0;
  config.biquads = biquads;
  return DriveControl<double>::create(config).value();
}
double excited(int k) { return std::sin(0.35 * k) + 0.4 * std::cos(0.08 * k) + 2.0; }

/// Filters are 1 at standstill: a constant torque does not move at all.
TEST(FilterExchange, LeavesAConstantTorqueAlone) {
  auto control = proportional(test::kFilters);
  for (int k = 0; k < 3000; ++k) {
    if (k == 2000) {
      ASSERT_TRUE(control.exchange_filters(kOthers, 20, 50));
    }
    if (k == 2400) {
      ASSERT_TRUE(control.exchange_filters({}, 0, 1));
    }
    const double torque = control.step(velocity_inputs<double>(10.0, 0.0));
    if (k > 1500) {
      EXPECT_NEAR(torque, 6.0, 1e-12) << k;
    }
  }
}

/// Old, old + w (new - old), new: w = 1/N ... 1 behind the warm-up; the new ones have run along since then.
TEST(FilterExchange, IsTheMeanOfBothWhileItFades) {
  constexpr int kAt = 500, kWarm = 40, kFade = 64;
  auto control = proportional(test::kFilters), old = control;
  std::vector<test::DirectBiquad> fresh;
  for (const Biquad& biquad : kOthers) fresh.emplace_back(biquad, kRate);
  // New biquads begin at rest under the last input: as if it had stood for ever.
  for (int k = 0; k < 20000; ++k) {
    long double x = 0.6L * excited(kAt - 1);
    for (auto& section : fresh) x = section.step(x);
  }
  for (int k = 0; k < 1200; ++k) {
    if (k == kAt) {
      ASSERT_TRUE(control.exchange_filters(kOthers, kWarm, kFade));
    }
    const double torque = control.step(velocity_inputs<double>(excited(k), 0.0));
    const double before = old.step(velocity_inputs<double>(excited(k), 0.0));
    long double after = 0.6L * excited(k);
    if (k >= kAt)
      for (auto& section : fresh) after = section.step(after);
    const double share = std::clamp((k - (kAt + kWarm - 1.0)) / kFade, 0.0, 1.0);
    EXPECT_NEAR(torque, before + share * (static_cast<double>(after) - before), 1e-11) << k;
    EXPECT_EQ(control.exchanging(), k >= kAt && k < kAt + kWarm + kFade - 1) << k;
    if (share == 0.0) {
      EXPECT_EQ(torque, before);
    }  // no state of the old ones is touched
  }
}

/// Between two samples of the fade the torque moves by what either filter moves, and a share of how far they
/// are apart: a hard exchange jumps by all of it.
TEST(FilterExchange, IsContinuous) {
  constexpr int kAt = 500, kFade = 100;
  auto faded = proportional(test::kFilters), hard = faded, old = faded, fresh = proportional(kOthers);
  double before[4] = {}, apart = 0.0, moved = 0.0, faded_step = 0.0, hard_step = 0.0;
  for (int k = 0; k < 800; ++k) {
    if (k == kAt) {
      ASSERT_TRUE(faded.exchange_filters(kOthers, 0, kFade));
    }
    if (k == kAt) {
      ASSERT_TRUE(hard.exchange_filters(kOthers, 0, 1));
    }
    const auto inputs = velocity_inputs<double>(excited(k), 0.0);
    const double now[4] = {faded.step(inputs), hard.step(inputs), old.step(inputs), fresh.step(inputs)};
    if (k >= kAt && k < kAt + kFade) {
      faded_step = std::max(faded_step, std::abs(now[0] - before[0]));
      hard_step = std::max(hard_step, std::abs(now[1] - before[1]));
      moved = std::max({moved, std::abs(now[2] - before[2]), std::abs(now[3] - before[3])});
      apart = std::max(apart, std::abs(now[2] - now[3]));
    }
    std::copy(std::begin(now), std::end(now), before);
  }
  EXPECT_GT(apart, 0.3);
  EXPECT_LT(faded_step, moved + 2.0 * apart / kFade);
  EXPECT_GT(hard_step, faded_step);
}

/// In a running loop with its integrator: a lag under control, whose filters are changed twice.
TEST(FilterExchange, DoesNotDisturbALoopAtRest) {
  auto control = DriveControl<double>::create(filtered_config()).value();
  double velocity = 0.0, largest = 0.0;
  for (int k = 0; k < 6000; ++k) {
    if (k == 3000) {
      ASSERT_TRUE(control.exchange_filters(kOthers, 100, 200));
    }
    if (k == 4500) {
      ASSERT_TRUE(control.exchange_filters(test::kFilters, 0, 1));
    }
    const double torque = control.step(velocity_inputs<double>(5.0, velocity));
    velocity += 0.02 * (torque - 0.3 * velocity);
    if (k >= 3000) largest = std::max(largest, std::abs(velocity - 5.0));
  }
  EXPECT_LT(largest, 1e-10);
}

TEST(FilterExchange, RefusesASecondOneAndWhatIsNoFilter) {
  auto control = proportional(test::kFilters);
  EXPECT_EQ(control.exchange_filters(kOthers, 1, 0).error().field, "fade_samples");
  constexpr std::array<Biquad, 1> kBad{{{600.0, 0.1, 0.5}}};
  EXPECT_EQ(control.exchange_filters(kBad, 1, 1).error().field, "biquads");
  EXPECT_FALSE(control.exchanging());
  ASSERT_TRUE(control.exchange_filters(kOthers, 1, 2));
  EXPECT_EQ(control.exchange_filters(kOthers, 1, 2).error().field, "biquads");
  for (int k = 0; k < 3; ++k) control.step(velocity_inputs<double>(1.0, 0.0));
  EXPECT_TRUE(control.exchange_filters(test::kFilters, 1, 2));
  control.reset();
  EXPECT_FALSE(control.exchanging());
  auto fresh = proportional(test::kFilters);  // the exchange is over, not undone
  for (int k = 0; k < 50; ++k)
    EXPECT_EQ(control.step(velocity_inputs<double>(excited(k), 0.0)),
              fresh.step(velocity_inputs<double>(excited(k), 0.0)));
}

}  // namespace
}  // namespace resonid::online
