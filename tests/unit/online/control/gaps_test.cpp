// SPDX-License-Identifier: MIT
// Samples that are missing: the torque stays for a while, then the controller rests.
#include <gtest/gtest.h>

#include <limits>
#include <resonid/online/control.hpp>

#include "direct_law.hpp"

namespace resonid::online {
namespace {

using test::filtered_config;
using test::kRate;
using test::Noise;
using test::velocity_inputs;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Control>
void warm_up(Control& control, int samples = 300) {
  Noise noise(9);
  for (int k = 0; k < samples; ++k) control.step(velocity_inputs<double>(3.0, noise()));
}

TEST(ControlGaps, AShortOneIsASampleNotTaken) {
  auto gapped = DriveControl<double>::create(filtered_config()).value(), plain = gapped;
  warm_up(gapped);
  warm_up(plain);
  const double torque = gapped.torque();
  EXPECT_EQ(gapped.step(velocity_inputs<double>(3.0, kNan)), torque);
  EXPECT_EQ(gapped.step(velocity_inputs<double>(INFINITY, 0.0)), torque);
  EXPECT_FALSE(gapped.in_gap());
  EXPECT_EQ(gapped.skipped_samples(), 2U);
  EXPECT_EQ(gapped.samples(), plain.samples() + 2);
  for (int k = 0; k < 100; ++k)
    EXPECT_EQ(gapped.step(velocity_inputs<double>(1.0, 0.5)), plain.step(velocity_inputs<double>(1.0, 0.5)));
}

TEST(ControlGaps, ALongOneBringsItToRest) {
  DriveControlConfig config = filtered_config();
  config.longest_gap_samples = 5;
  auto control = DriveControl<double>::create(config).value(), told = control, fresh = control;
  warm_up(control);
  warm_up(told);
  for (int k = 0; k < 6; ++k) {
    const double torque = control.step(velocity_inputs<double>(3.0, kNan));
    EXPECT_EQ(torque != 0.0, k < 5) << k;
    EXPECT_EQ(control.in_gap(), k == 5) << k;
  }
  told.miss(6);
  EXPECT_TRUE(told.in_gap());
  EXPECT_EQ(told.skipped_samples(), 6U);
  for (int k = 0; k < 100; ++k) {
    const auto inputs = velocity_inputs<double>(1.0, 0.01 * k);
    const double torque = fresh.step(inputs);
    EXPECT_EQ(control.step(inputs), torque);
    EXPECT_EQ(told.step(inputs), torque);
    EXPECT_FALSE(control.in_gap());
  }
}

/// Only what is in use has to be there.
TEST(ControlGaps, WhatIsNotUsedMayBeMissing) {
  DriveControlConfig config = filtered_config();
  auto velocity = DriveControl<double>::create(config).value();
  config.kv = 5.0;
  auto cascade = DriveControl<double>::create(config).value();
  config.sums_velocity = true;
  auto summing = DriveControl<double>::create(config).value();
  ControlInputs<double> inputs{.reference = 1.0, .velocity = 0.0, .position = kNan};
  velocity.step(inputs);
  cascade.step(inputs);
  summing.step(inputs);
  EXPECT_EQ(velocity.skipped_samples(), 0U);
  EXPECT_EQ(cascade.skipped_samples(), 1U);
  EXPECT_EQ(summing.skipped_samples(), 0U);
  inputs.velocity_feed_forward = kNan;
  velocity.step(inputs);
  summing.step(inputs);
  EXPECT_EQ(velocity.skipped_samples(), 0U);
  EXPECT_EQ(summing.skipped_samples(), 1U);
  inputs.torque_feed_forward = kNan;
  velocity.step(inputs);
  EXPECT_EQ(velocity.skipped_samples(), 1U);
}

/// A summed position goes on at the last velocity, and after too long a gap is no longer certain.
TEST(ControlGaps, ASummedPositionGoesOn) {
  DriveControlConfig config = filtered_config();
  config.kv = 5.0;
  config.sums_velocity = true;
  config.longest_gap_samples = 10;
  auto control = DriveControl<double>::create(config).value();
  for (int k = 0; k < 100; ++k) control.step(velocity_inputs<double>(0.0, 2.0));
  control.miss(10);
  EXPECT_NEAR(control.position(), 110 * 2.0 / kRate, 1e-14);
  EXPECT_TRUE(control.position_certain());
  control.miss(1);
  EXPECT_NEAR(control.position(), 110 * 2.0 / kRate, 1e-14);
  EXPECT_FALSE(control.position_certain());
  EXPECT_TRUE(control.in_gap());
  control.set_position(0.25);
  EXPECT_TRUE(control.position_certain());
  control.step(velocity_inputs<double>(0.0, 2.0));
  EXPECT_NEAR(control.position(), 0.252, 1e-15);
  control.miss(std::numeric_limits<std::uint64_t>::max() / 2);
  EXPECT_TRUE(control.in_gap());
  EXPECT_TRUE(control.intact());
}

/// Finite values whose products are not: never given to a drive, and forgotten.
TEST(ControlGaps, AnInfiniteTorqueIsNeverGiven) {
  auto control = DriveControl<float>::create(filtered_config()).value(), fresh = control;
  for (int k = 0; k < 50; ++k) control.step(velocity_inputs<float>(1.0, 0.0));
  EXPECT_EQ(control.step(velocity_inputs<float>(3e38, -3e38)), 0.0F);
  EXPECT_TRUE(control.in_gap());
  EXPECT_EQ(control.skipped_samples(), 1U);
  for (int k = 0; k < 50; ++k)
    EXPECT_EQ(control.step(velocity_inputs<float>(1.0, 0.0)), fresh.step(velocity_inputs<float>(1.0, 0.0)));
}

}  // namespace
}  // namespace resonid::online
