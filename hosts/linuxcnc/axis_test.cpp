// SPDX-License-Identifier: MIT
#include "axis.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <resonid/base/detail/linear_system.hpp>

#include "allocation_counter.hpp"

namespace resonid::linuxcnc {
namespace {

constexpr double kPeriod_s = 500e-6, kJ1 = 0.0012, kJ2 = 0.0018, kStiffness = 150.0, kDamping = 0.02;
constexpr resonid_axis_shape kShape{kPeriod_s, 10.0, 110.0, 21, 0.3};

double hz(double omega) { return omega / (2.0 * std::numbers::pi); }
const double kResonanceHz = hz(std::sqrt(kStiffness * (1.0 / kJ1 + 1.0 / kJ2)));
const double kAntiresonanceHz = hz(std::sqrt(kStiffness / kJ2));

resonid_axis_settings settings() {
  resonid_axis_settings s{};
  s.amplitude = 0.5;
  s.ramp_s = 0.5;
  s.sweep_s = 5.0;
  s.margin = 0.9;
  s.max_std = 0.01;
  return s;
}

/// A P-controlled drive at 20 rad/s with an axis beside it.
class Machine {
 public:
  explicit Machine(double stiffness = kStiffness, double noise = 0.0) : noise_(0.0, noise) {
    LinearSystem<double, 4> drive;  // position, velocity, twist, velocity of the load
    drive.a(0, 1) = 1.0;
    drive.a.row(1) << 0.0, -kDamping / kJ1, -stiffness / kJ1, kDamping / kJ1;
    drive.a.row(2) << 0.0, 1.0, 0.0, -1.0;
    drive.a.row(3) << 0.0, kDamping / kJ2, stiffness / kJ2, -kDamping / kJ2;
    drive.b(1) = 1.0 / kJ1;
    drive_ = zero_order_hold(drive, kPeriod_s);
    state_ << 0.0, 20.0, 0.0, 20.0;
  }
  void step(Axis& axis, const resonid_axis_settings& s, bool valid = true, bool enable = true) {
    resonid_axis_sample x{};
    x.enable = enable ? 1 : 0;
    x.valid = valid ? 1 : 0;
    x.position = state_(0);
    x.velocity = state_(1) + (noise_.stddev() > 0.0 ? noise_(random_) : 0.0);
    x.control = 0.2 * (20.0 - x.velocity);
    x.torque = x.control + axis.excite(s, x);
    largest_excitation_ = std::max(largest_excitation_, std::abs(x.torque - x.control));
    if (!valid) x.velocity = std::numeric_limits<double>::quiet_NaN();
    axis.identify(s, x);
    state_ = (drive_.a * state_ + drive_.b * x.torque).eval();
  }
  void run(Axis& axis, const resonid_axis_settings& s, double duration_s, bool enable = true) {
    for (double t = 0.0; t < duration_s; t += kPeriod_s) step(axis, s, true, enable);
  }
  [[nodiscard]] double position() const { return state_(0); }
  [[nodiscard]] double largest_excitation() const { return largest_excitation_; }

 private:
  LinearSystem<double, 4> drive_;
  Eigen::Vector4d state_;
  std::mt19937_64 random_{3};
  std::normal_distribution<double> noise_;
  double largest_excitation_ = 0.0;
};

Axis axis(const resonid_axis_shape& shape = kShape) { return Axis::create(shape).value(); }

TEST(LinuxcncAxis, FindsAResonanceAndTrustsIt) {
  Axis a = axis();
  Machine machine;
  const std::size_t before = test::allocations();
  machine.run(a, settings(), 4.0);
  EXPECT_EQ(test::allocations(), before);
  const auto& r = a.results();
  EXPECT_EQ(r.trust_reason, RESONID_TRUSTED);
  EXPECT_NEAR(r.resonance_hz, kResonanceHz, 1e-3 * kResonanceHz);
  EXPECT_NEAR(r.antiresonance_hz, kAntiresonanceHz, 1e-3 * kAntiresonanceHz);
  EXPECT_NEAR(r.motor_inertia, kJ1, 0.01 * kJ1);
  EXPECT_NEAR(r.load_inertia, kJ2, 0.01 * kJ2);
  EXPECT_NEAR(machine.largest_excitation(), 0.5, 0.01);
}

TEST(LinuxcncAxis, KeepsWhatItFoundAfterEnableHasFallen) {
  Axis a = axis();
  Machine machine;
  machine.run(a, settings(), 4.0);
  const double resonance_hz = a.results().resonance_hz;
  machine.run(a, settings(), 1.0, false);
  EXPECT_EQ(a.results().running, 0);
  EXPECT_EQ(a.results().stop_reason, static_cast<int>(online::StopReason::requested));
  EXPECT_EQ(a.results().trust_reason, RESONID_TRUSTED);
  EXPECT_NEAR(a.results().resonance_hz, resonance_hz, 0.01);
  machine.run(a, settings(), 0.1);
  EXPECT_EQ(a.results().trust_reason, RESONID_NOT_SETTLED);
}

TEST(LinuxcncAxis, StartsAgainWhenEnabledDuringTheRampOut) {
  Axis a = axis();
  Machine machine;
  const auto s = settings();
  machine.run(a, s, 1.0);
  machine.run(a, s, 0.1, false);
  ASSERT_EQ(a.results().running, 1);
  machine.run(a, s, 2.0);
  EXPECT_EQ(a.results().running, 1);
  EXPECT_EQ(a.results().stop_reason, 0);
}

TEST(LinuxcncAxis, DoesNotTrustNoise) {
  Axis a = axis();
  Machine(kStiffness, 20.0).run(a, settings(), 4.0);
  EXPECT_FALSE(a.results().trusted);
  EXPECT_LT(a.results().coherence, 0.9);
}

TEST(LinuxcncAxis, DoesNotTrustWhatLiesOutsideTheLines) {
  Axis a = axis({kPeriod_s, 10.0, 60.0, 21, 0.3});
  Machine().run(a, settings(), 4.0);
  EXPECT_EQ(a.results().trust_reason, RESONID_OUTSIDE_THE_LINES);
}

TEST(LinuxcncAxis, DoesNotTrustAStiffDrive) {
  Axis a = axis();
  Machine(1e5, 0.02).run(a, settings(), 4.0);  // resonance at 1876 Hz
  EXPECT_FALSE(a.results().trusted);
}

TEST(LinuxcncAxis, BridgesMissingSamplesAndSaysWhenThereAreTooMany) {
  for (const int every : {50, 7}) {
    Axis a = axis();
    Machine machine;
    const auto s = settings();
    for (int k = 0; k < 10'000; ++k) machine.step(a, s, k % every != every - 1);
    const auto& r = a.results();
    EXPECT_EQ(r.skipped_samples, 10'000U / static_cast<unsigned>(every));
    EXPECT_NEAR(r.resonance_hz, kResonanceHz, 0.01 * kResonanceHz) << every;
    EXPECT_EQ(r.trust_reason, every == 50 ? RESONID_TRUSTED : RESONID_SAMPLES_MISSING);
  }
}

TEST(LinuxcncAxis, StopsBeforeTheEndOfTravel) {
  Axis a = axis();
  Machine machine;
  auto s = settings();
  s.position_low = -20.0;
  s.position_high = 90.0;  // reached at 20 rad/s after 4.5 s
  s.deceleration = 1000.0;
  machine.run(a, s, 3.5);
  EXPECT_EQ(a.results().stop_reason, 0);
  while (a.results().running != 0 && machine.position() < 90.0) machine.step(a, s);
  EXPECT_LT(machine.position(), 90.0);
  EXPECT_EQ(a.results().stop_reason, static_cast<int>(online::StopReason::position));
  machine.step(a, s);
  EXPECT_EQ(a.results().trust_reason, RESONID_STOPPED);
}

TEST(LinuxcncAxis, RefusesWhatItCannotStartWith) {
  for (auto change : {+[](resonid_axis_settings& s) { s.amplitude = 0.0; },
                      +[](resonid_axis_settings& s) { s.excitation = 7; },
                      +[](resonid_axis_settings& s) { s.margin = 2.0; },
                      +[](resonid_axis_settings& s) { s.position_high = 5.0; }}) {
    Axis a = axis();
    Machine machine;
    auto s = settings();
    change(s);
    machine.run(a, s, 0.1);
    EXPECT_EQ(a.results().trust_reason, RESONID_REFUSED);
    EXPECT_EQ(machine.largest_excitation(), 0.0);
  }
  for (const resonid_axis_shape shape : {resonid_axis_shape{kPeriod_s, 10.0, 110.0, 2, 0.3},
                                         {kPeriod_s, 10.0, 110.0, RESONID_MAX_LINES + 1, 0.3},
                                         {kPeriod_s, 110.0, 10.0, 21, 0.3},
                                         {kPeriod_s, 10.0, 1100.0, 21, 0.3},
                                         {kPeriod_s, 10.0, 110.0, 21, 0.001},
                                         {0.0, 10.0, 110.0, 21, 0.3}})
    EXPECT_FALSE(Axis::create(shape).has_value());
}

TEST(LinuxcncAxis, CopiesGoOnBitForBit) {
  Axis a = axis();
  Machine machine(kStiffness, 0.1);
  machine.run(a, settings(), 3.0);
  Axis copy = a;
  Machine same = machine;
  machine.run(a, settings(), 0.5);
  same.run(copy, settings(), 0.5);
  const auto &r = a.results(), &c = copy.results();
  EXPECT_GT(r.updates, 0U);
  EXPECT_EQ(r.updates, c.updates);
  EXPECT_EQ(r.resonance_hz, c.resonance_hz);
  EXPECT_EQ(r.antiresonance_std_hz, c.antiresonance_std_hz);
  EXPECT_EQ(r.worst_phase_margin_deg, c.worst_phase_margin_deg);
  EXPECT_EQ(r.modulus_margin_std, c.modulus_margin_std);
  EXPECT_EQ(r.coherence, c.coherence);
}

}  // namespace
}  // namespace resonid::linuxcnc
