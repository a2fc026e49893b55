// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/online/supervision/loop_margins.hpp>
#include <resonid/plant/experiment.hpp>
#include <vector>

#include "machines.hpp"

namespace resonid::plant {
namespace {

using test::LoopConfig;

constexpr double kStep = 0.002;
constexpr double kCount = kTwoPi / 8192.0;

LoopConfig frictionless(double velocity, double count, double delay_s = 0.0) {
  LoopConfig c;
  c.machine.drive = test::rigid();
  c.machine.drive.viscous_friction = 0.0;
  c.motion.kind = MotionKind::constant;
  c.motion.velocity = velocity;
  c.velocity = VelocitySource::encoder;
  c.count = count;
  c.delay_s = delay_s;
  return c;
}

double mean_square(const std::vector<double>& x) {
  double sum = 0.0;
  for (const double value : x) sum += value * value;
  return sum / static_cast<double>(x.size());
}

// Speeding up, the way over one sample takes every fraction of a count: two independent rounding errors,
// uniform over one count q, make the variance q^2/(6 Ts^2). Their differences have the fourth moment 2.4
// variance^2 and neighbours correlate by -1/2: the mean square of N has the deviation sqrt(1.4 + 2 0.25 ...)
// below sqrt(2.5/N).
TEST(Encoder, RoundingAddsTheAnalyticNoise) {
  auto loop = test::make_loop(frictionless(7.0, kCount));
  std::vector<double> velocity_error, position_error;
  const double acceleration = 0.01 / 0.05;
  const auto angle = [&](double t) { return 7.0 * t + 0.5 * acceleration * std::max(t, 0.0) * t; };
  for (int k = 0; k < 40000; ++k) {
    const auto s = loop.step(0.01, 0.0);
    velocity_error.push_back(s.output - (angle(k * kStep) - angle((k - 1) * kStep)) / kStep);
  }
  const double expected = std::pow(encoder_velocity_noise(8192.0, kStep), 2);
  EXPECT_NEAR(expected, kCount * kCount / (6.0 * kStep * kStep), 1e-15);
  EXPECT_NEAR(mean_square(velocity_error) / expected, 1.0, 4.0 * std::sqrt(2.5 / 40000.0));
  double mean = 0.0;
  for (const double e : velocity_error) mean += e / 40000.0;
  EXPECT_LT(std::abs(mean), kCount / kStep / 40000.0);  // rounding errors of first and last sample are left
}

// At a constant speed of n + f counts a sample the difference is n or n + 1: variance f (1 - f) q^2/Ts^2.
TEST(Encoder, RoundingAtConstantSpeedDependsOnTheFractionOfACount) {
  for (const double fraction :
       {0.5 + 1e-3 * std::sqrt(2.0), 0.1 + 1e-3 * std::sqrt(2.0), 0.01 * std::sqrt(3.0)}) {
    const double velocity = (20.0 + fraction) * kCount / kStep;
    auto loop = test::make_loop(frictionless(velocity, kCount));
    std::vector<double> error;
    for (int k = 0; k < 40000; ++k) error.push_back(loop.step(0.0, 0.0).output - velocity);
    const double expected = fraction * (1.0 - fraction) * std::pow(kCount / kStep, 2);
    EXPECT_NEAR(mean_square(error) / expected, 1.0, 2e-3) << fraction;
  }
}

TEST(Encoder, PositionIsUnbiasedAndWithinHalfACount) {
  MotionSensor sensor({0, 0.0}, VelocitySource::encoder, kCount, kStep);
  sensor.settle({7.1, 0.0});
  double sum = 0.0;
  double square = 0.0;
  constexpr int kN = 100000;
  for (int k = 0; k < kN; ++k) {
    const double angle = 7.1 * kStep * k;
    const double error = sensor.read().angle - angle;
    ASSERT_LE(std::abs(error), 0.5 * kCount * (1.0 + 1e-9));
    sum += error;
    square += error * error;
    sensor.push({7.1, 7.1 * kStep * (k + 1)});
  }
  EXPECT_LT(std::abs(sum / kN), 4.0 * kCount / std::sqrt(12.0 * kN));
  EXPECT_NEAR(square / kN / (kCount * kCount / 12.0), 1.0, 4.0 * std::sqrt(0.8 / kN));
}

TEST(Encoder, DifferencesOfTheDelayedPosition) {
  for (const double count : {0.0, kCount})
    for (const double delay : {0.0, 0.002, 0.004, 0.0047, 0.0013}) {
      auto loop = test::make_loop(frictionless(3.0, count, delay));
      const auto angle = [&](double t) { return 3.0 * t + (t > 0.0 ? 0.5 * (0.4 / 0.05) * t * t : 0.0); };
      for (int k = 0; k < 200; ++k) {
        const double t = k * kStep - delay;
        EXPECT_NEAR(loop.step(0.4, 0.0).output, (angle(t) - angle(t - kStep)) / kStep,
                    1e-11 + count / kStep * (1.0 + 1e-9))
            << delay << " " << k;
      }
    }
}

MeasurementConfig coloured(double rms, double bandwidth_hz) {
  MeasurementConfig c;
  c.noise_rms = rms;
  c.noise_bandwidth_hz = bandwidth_hz;
  return c;
}

// First-order noise of a = exp(-2 pi f Ts): correlation a^n; the variance of N samples is known to
// sqrt(2/N (1 + a^2)/(1 - a^2)).
TEST(MeasurementNoise, ColouredNoiseKeepsItsDeviation) {
  constexpr int kN = 400000;
  MeasurementNoise noise(coloured(0.3, 20.0), 500.0, 5);
  std::vector<double> x(kN);
  for (double& value : x) value = noise.step();
  const double a = std::exp(-kTwoPi * 20.0 / 500.0);
  const double spread = std::sqrt(2.0 / kN * (1.0 + a * a) / (1.0 - a * a));
  EXPECT_NEAR(mean_square(x) / 0.09, 1.0, 4.0 * spread);
  for (const int lag : {1, 3, 10}) {
    double sum = 0.0;
    for (int k = lag; k < kN; ++k) sum += x[k] * x[k - lag];
    EXPECT_NEAR(sum / (kN - lag) / 0.09, std::pow(a, lag), 4.0 * spread);
  }
}

TEST(MeasurementNoise, ColouredNoiseHasTheFirstOrderSpectrum) {
  constexpr int kLength = 2000;
  constexpr int kSegments = 200;
  const std::vector<int> bins{10, 40, 80, 200, 500, 900};
  std::vector<double> power(bins.size(), 0.0);
  MeasurementNoise noise(coloured(0.3, 20.0), 500.0, 9);
  for (int s = 0; s < kSegments; ++s) {
    std::vector<double> x(kLength);
    for (double& value : x) value = noise.step();
    for (std::size_t i = 0; i < bins.size(); ++i) {
      std::complex<double> sum = 0.0;
      for (int k = 0; k < kLength; ++k)
        sum += x[k] * std::polar(1.0, -kTwoPi * ((k * bins[i]) % kLength) / kLength);
      power[i] += std::norm(sum) / kLength / kSegments;
    }
  }
  const double a = std::exp(-kTwoPi * 20.0 / 500.0);
  for (std::size_t i = 0; i < bins.size(); ++i) {
    const double expected =
        0.09 * (1.0 - a * a) / std::norm(1.0 - a * std::polar(1.0, -kTwoPi * bins[i] / kLength));
    EXPECT_NEAR(power[i] / expected, 1.0, 4.0 / std::sqrt(kSegments)) << bins[i];
  }
}

// Over many seeds the first sample has the full deviation as well.
TEST(MeasurementNoise, ColouredNoiseIsStationaryFromTheStart) {
  std::vector<double> first(4000);
  for (std::size_t i = 0; i < first.size(); ++i)
    first[i] = MeasurementNoise(coloured(0.3, 1.0), 500.0, i).step();
  EXPECT_NEAR(mean_square(first) / 0.09, 1.0, 4.0 * std::sqrt(2.0 / 4000.0));
}

TEST(Torque, IsRoundedToItsResolution) {
  LoopConfig c = frictionless(0.0, 0.0);
  c.torque_resolution = 0.05;
  auto loop = test::make_loop(c);
  for (int k = 0; k < 1000; ++k) {
    const double wanted = std::sin(0.7 * k);
    const double torque = loop.step(wanted, 0.0).input;
    EXPECT_LE(std::abs(torque - wanted), 0.025 + 1e-12);
    EXPECT_NEAR(torque, 0.05 * std::round(torque / 0.05), 1e-15);
  }
}

TEST(Torque, RoundingStaysWithinTheLimit) {
  LoopConfig c = frictionless(0.0, 0.0);
  c.torque_resolution = 0.1;
  c.controller.torque_limit = 0.56;
  auto loop = test::make_loop(c);
  for (int k = 0; k < 1000; ++k) {
    const double wanted = std::sin(0.7 * k);
    const double torque = loop.step(wanted, 0.0).input;
    EXPECT_LE(std::abs(torque), 0.5 + 1e-12);
    EXPECT_LE(std::abs(torque - std::clamp(wanted, -0.55, 0.55)), 0.05 + 1e-12);
  }
}

/// Two masses that are shaken in the open or under a proportional controller.
ExperimentConfig shaken(ControllerKind kind) {
  ExperimentConfig c;
  c.drive = test::system_2();
  c.controller.kind = kind;
  c.controller.gain = 0.5;
  c.excitation.kind = online::Kind::prbs;
  c.measurement.delay_s = 0.0013;
  c.measurement.noise_rms = 0.05;
  c.run = {500.0, 2.0, 3};
  return c;
}

// Record and controller both see what the filter makes of velocity and noise, renewed every third sample.
TEST(VelocityFilter, IsWhatRecordAndControllerSee) {
  ExperimentConfig open = shaken(ControllerKind::none);
  const auto plain = simulate_closed_loop(open).value().record.output.samples;
  open.measurement.filter_s = 0.005;
  open.measurement.hold_samples = 3;
  const auto seen = simulate_closed_loop(open).value().record.output.samples;
  const double p = std::exp(-0.002 / 0.005);
  double filtered = 0.0;
  double renewed = 0.0;
  for (std::size_t k = 0; k < plain.size(); ++k) {
    filtered = p * filtered + (1.0 - p) * plain[k];
    if (k % 3 == 0) renewed = filtered;
    ASSERT_NEAR(seen[k], renewed, 1e-12) << k;
  }
  ExperimentConfig closed = shaken(ControllerKind::p);
  closed.measurement.filter_s = 0.005;
  closed.measurement.hold_samples = 3;
  const auto record = simulate_closed_loop(closed).value().record;
  for (std::size_t k = 0; k < record.samples(); ++k)
    ASSERT_NEAR(record.input.samples[k], record.excitation.samples[k] - 0.5 * record.output.samples[k],
                1e-12);
}

// What the loop's response promises is where the loop becomes unstable.
TEST(VelocityFilter, GainMarginOfAHeldLoopIsWhereItBecomesUnstable) {
  for (const std::uint64_t samples : {1, 2, 4, 5}) {
    ExperimentConfig c = shaken(ControllerKind::pi);
    c.controller.integral_time_s = 0.2;
    c.measurement.filter_s = samples == 5 ? 0.003 : 0.0;
    c.measurement.hold_samples = samples;
    const auto loop = simulate_closed_loop(c).value().truth.loop;
    const auto margins = online::loop_margins<double>(loop.frequency_hz, loop.value);
    // At half the rate of the new values the loop is real and may end at -180 degrees.
    const double end = loop.value.back().real();
    EXPECT_NEAR(loop.value.back().imag(), 0.0, 1e-9) << samples;
    const double factor =
        std::fmin(std::pow(10.0, margins.gain_margin_db / 20.0), end < 0.0 ? -1.0 / end : NAN);
    ASSERT_GT(factor, 1.0) << samples;
    const double gain = c.controller.gain * factor;
    c.controller.gain = 0.998 * gain;
    EXPECT_TRUE(simulate_closed_loop(c)) << samples;
    c.controller.gain = 1.002 * gain;
    EXPECT_FALSE(simulate_closed_loop(c)) << samples;
  }
}

// The load by its equation of motion, from a drive that runs eight times as fast under the same torque; as
// late as the velocity.
TEST(SecondOutput, IsTheMotionOfTheLoadAsLateAsTheVelocity) {
  for (const auto kind : {data::SecondOutput::load_encoder, data::SecondOutput::load_accelerometer})
    for (const double friction : {0.0, 0.3}) {
      ExperimentConfig c = shaken(ControllerKind::none);
      c.friction.load.coulomb = friction;
      c.motion.kind = MotionKind::constant;
      c.motion.velocity = 30.0 * friction;  // with friction it slides on
      c.disturbance.load_torque = 0.2;
      c.measurement.delay_s = 1.375 * 0.002;
      c.measurement.second_output = kind;
      const auto record = simulate_closed_loop(c).value().record;
      EXPECT_EQ(record.second_output_kind, kind);
      const auto fast = make_drive({c.drive, c.friction, c.disturbance, 0.0}, 4000.0, 0.0).value();
      const double holding = fast->settle(c.motion.velocity, 0.0);
      std::vector<double> course;  // at multiples of 1/4000 s
      for (std::size_t k = 0; k < 400; ++k)
        for (int i = 0; i < 8; ++i) {
          const auto m = fast->motions();
          const double shaft = 143.75 * (m[0].angle - m[1].angle) + 0.3 * (m[0].velocity - m[1].velocity);
          ASSERT_TRUE(friction == 0.0 || m[1].velocity > 0.0);
          course.push_back(kind == data::SecondOutput::load_encoder ? m[1].angle
                                                                    : (shaft + 0.2 - friction) / 0.032);
          fast->advance(record.input.samples[k]);
        }
      EXPECT_NEAR(record.input.samples[0] - record.excitation.samples[0], holding, 1e-12);
      double largest = 0.0;
      for (std::size_t k = 2; k < 400; ++k) {
        const double expected = course[8 * k - 11];
        largest = std::max(largest, std::abs(expected));
        ASSERT_NEAR(record.second_output.samples[k], expected, 1e-9 * std::max(1.0, largest))
            << k << " " << friction;
      }
      EXPECT_GT(largest, 0.01);
    }
}

TEST(SecondOutput, HasNoiseOfItsOwn) {
  ExperimentConfig c = shaken(ControllerKind::none);
  c.run.duration_s = 40.0;
  c.measurement.second_output = data::SecondOutput::load_encoder;
  const auto quiet = simulate_closed_loop(c).value().record;
  c.measurement.second_noise = 2e-4;
  const auto noisy = simulate_closed_loop(c).value().record;
  EXPECT_EQ(quiet.output.samples, noisy.output.samples);
  double square = 0.0, product = 0.0;
  const auto clean = [&] {
    ExperimentConfig silent = c;
    silent.measurement.noise_rms = 0.0;
    return simulate_closed_loop(silent).value().record.output.samples;
  }();
  const double n = static_cast<double>(quiet.samples());
  for (std::size_t k = 0; k < quiet.samples(); ++k) {
    const double second = (noisy.second_output.samples[k] - quiet.second_output.samples[k]) / 2e-4;
    square += second * second / n;
    product += second * (noisy.output.samples[k] - clean[k]) / 0.05 / n;
  }
  EXPECT_NEAR(square, 1.0, 4.0 * std::sqrt(2.0 / n));
  EXPECT_NEAR(product, 0.0, 4.0 / std::sqrt(n));
  c.drive = test::rigid();
  EXPECT_EQ(std::string(simulate_closed_loop(c).error().field), "measurement.second_output");
}

}  // namespace
}  // namespace resonid::plant
