// SPDX-License-Identifier: MIT
//
// Where a closed loop becomes unstable, three ways: the check before a run, growth of the simulated loop, and
// the gain margin of the analytic response.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <resonid/base/error_text.hpp>
#include <resonid/plant/experiment.hpp>

#include "analytic.hpp"
#include "machines.hpp"
#include "plant/loop_poles.hpp"

namespace resonid::plant {
namespace {

struct Case {
  std::string name;
  ExperimentConfig config;
};

std::vector<Case> cases() {
  ExperimentConfig base;
  base.drive = test::system_2();
  base.controller = test::pi_controller(1.0, 0.147);
  base.excitation.kind = online::Kind::prbs;
  base.measurement.delay_s = 0.004;
  base.run = {500.0, 2.0, 1};
  std::vector<Case> result{{"two samples", base}};
  Case fraction{"2.65 samples", base};
  fraction.config.measurement.delay_s = 0.0053;
  result.push_back(fraction);
  Case encoder{"encoder", base};
  encoder.config.measurement.velocity = VelocitySource::encoder;
  result.push_back(encoder);
  Case both{"encoder, 2.65 samples", fraction.config};
  both.config.measurement.velocity = VelocitySource::encoder;
  result.push_back(both);
  Case lag{"torque lag", base};
  lag.config.actuator.lag_s = 0.003;
  result.push_back(lag);
  Case tensioner{"tensioner", base};
  tensioner.config.drive = test::with_tensioner();
  result.push_back(tensioner);
  Case rigid{"rigid without delay", base};
  rigid.config.drive = test::rigid();
  rigid.config.measurement.delay_s = 0.0;
  result.push_back(rigid);
  for (const auto velocity : {VelocitySource::sensor, VelocitySource::encoder}) {
    Case held{"held by springs", fraction.config};
    held.config.measurement.velocity = velocity;
    held.config.drive.motor_ground_stiffness = 20.0;
    held.config.drive.load_ground_stiffness = 35.0;
    result.push_back(held);
  }
  return result;
}

bool accepted(ExperimentConfig c, double gain) {
  c.controller.gain = gain;
  return check(c).has_value();
}

bool decays(const ExperimentConfig& c, double gain) {
  test::LoopConfig loop_config;
  loop_config.machine = {c.drive, {}, {}, c.actuator.lag_s};
  loop_config.controller = c.controller;
  loop_config.controller.gain = gain;
  loop_config.sample_rate_hz = c.run.sample_rate_hz;
  loop_config.delay_s = c.measurement.delay_s;
  loop_config.velocity = c.measurement.velocity;
  const VelocityPath path = velocity_path(c.measurement, c.run.sample_rate_hz, 0.0);
  loop_config.filter_pole = path.filter_pole;
  loop_config.hold = path.hold;
  auto loop = test::make_loop(loop_config);
  constexpr int kSamples = 40000;
  double early = 0.0;
  double late = 0.0;
  for (int k = 0; k < kSamples; ++k) {
    const double y = std::abs(loop.step(k == 0 ? 1.0 : 0.0, 0.0).output);
    if (!(y < 1e30)) return false;
    if (k >= kSamples / 4 && k < kSamples / 2) early = std::max(early, y);
    if (k >= 3 * kSamples / 4) late = std::max(late, y);
  }
  return late < early || late < 1e-9;
}

template <class Stable>
double critical_gain(Stable stable) {
  double low = 1e-3;
  double high = 1e3;
  while (high / low > 1.0 + 1e-5) {
    const double middle = std::sqrt(low * high);
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

/// Least gain at which the loop's Nyquist curve passes through -1.
double analytic_critical_gain(const ExperimentConfig& c, double up_to_hz = 1e9) {
  const test::Analytic plant(c.drive, c.actuator.lag_s);
  const SampleDelay delay = split_delay(c.measurement.delay_s, c.run.sample_rate_hz);
  const long double step = 1.0L / static_cast<long double>(c.run.sample_rate_hz);
  const auto loop = [&](double f) {
    const auto whole = static_cast<int>(delay.whole);
    const auto g = c.measurement.velocity == VelocitySource::sensor
                       ? plant.sampled(f, step, whole, delay.fraction)
                       : plant.sampled_difference(f, step, whole, delay.fraction);
    const std::complex<double> z = std::polar(1.0, kTwoPi * f / c.run.sample_rate_hz);
    return std::complex<double>(g) *
           (1.0 + 1.0 / (c.run.sample_rate_hz * c.controller.integral_time_s) * z / (z - 1.0));
  };
  double least = 1e9;
  const double end = std::min(0.5 * c.run.sample_rate_hz, up_to_hz);
  for (double f = 0.2; f < end; f += 0.1) {
    double low = f;
    double high = std::min(f + 0.1, end);
    if (high == end && loop(end).real() < 0.0) least = std::min(least, -1.0 / loop(end).real());
    if (loop(low).imag() * loop(high).imag() > 0.0) continue;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      (loop(low).imag() * loop(middle).imag() <= 0.0 ? high : low) = middle;
    }
    if (loop(low).real() < 0.0) least = std::min(least, -1.0 / loop(low).real());
  }
  return least;
}

TEST(Stability, CheckFlipsWhereTheLoopDoes) {
  for (const Case& c : cases()) {
    const ExperimentConfig& config = c.config;
    const double checked = critical_gain([&](double gain) { return accepted(config, gain); });
    const double simulated = critical_gain([&](double gain) { return decays(config, gain); });
    const double analytic = analytic_critical_gain(config);
    EXPECT_NEAR(checked / analytic, 1.0, 1e-4) << c.name << " " << analytic;
    EXPECT_NEAR(checked / simulated, 1.0, 1e-2) << c.name;
  }
}

// With a filter, a hold and a position loop the loop that is simulated is the witness.
TEST(Stability, KnowsFilterAndHold) {
  for (const auto kind : {ControllerKind::pi, ControllerKind::cascade})
    for (const auto& [filter_s, hold] : {std::pair{0.006, 1}, {0.0, 3}, {0.004, 4}}) {
      ExperimentConfig c = cases()[3].config;
      c.controller.kind = kind;
      c.controller.position_gain = 6.0;
      c.measurement.filter_s = filter_s;
      c.measurement.hold_samples = static_cast<std::uint64_t>(hold);
      const double checked = critical_gain([&](double gain) { return accepted(c, gain); });
      const double simulated = critical_gain([&](double gain) { return decays(c, gain); });
      EXPECT_NEAR(checked / simulated, 1.0, 1e-2) << filter_s << " " << hold;
      ExperimentConfig plain = c;
      plain.measurement.filter_s = 0.0;
      plain.measurement.hold_samples = 1;
      EXPECT_LT(checked, 0.97 * critical_gain([&](double gain) { return accepted(plain, gain); }));
    }
}

// The position of a cascade is not filtered: seen from the filtered velocity, its law undoes the filter.
TEST(Stability, FeedbackOfACascadeGivesTheTrueLoop) {
  ExperimentConfig c = cases()[0].config;
  c.controller.kind = ControllerKind::cascade;
  c.controller.position_gain = 6.0;
  c.controller.gain = 0.5;
  c.measurement.filter_s = 0.004;
  const auto truth = simulate_closed_loop(c).value().truth;
  for (std::size_t i = 0; i < truth.loop.lines(); i += 37) {
    const double f = truth.loop.frequency_hz[i];
    if (f < 0.5) continue;  // the law's polynomials cancel towards its three integrators
    const auto expected = truth.controller->response(f) * response(truth.sampled, f) *
                          std::polar(1.0, -kTwoPi * f * c.measurement.delay_s);
    EXPECT_LT(std::abs(truth.loop.value[i] - expected), 1e-9 * std::abs(expected)) << f;
  }
}

// Beyond 400 samples the turns of the Nyquist curve are counted, not the poles found.
TEST(Stability, LongDelaysAreJudgedToo) {
  for (const auto velocity : {VelocitySource::sensor, VelocitySource::encoder})
    for (const double delay_s : {0.0201, 0.05, 0.30001}) {
      ExperimentConfig c = cases().front().config;
      c.controller.integral_time_s = 1.0;
      c.measurement.velocity = velocity;
      c.measurement.delay_s = delay_s;
      c.run = {20000.0, 0.1, 1};
      const double critical = analytic_critical_gain(c, 60.0);  // |L| falls beyond the resonance at 15 Hz
      EXPECT_TRUE(accepted(c, 0.999 * critical)) << delay_s;
      EXPECT_FALSE(accepted(c, 1.001 * critical)) << delay_s;
      EXPECT_FALSE(accepted(c, 30.0 * critical)) << delay_s;
    }
}

TEST(Stability, TurnsAndPolesAgree) {
  for (const auto& [name, config] : cases()) {
    const double critical = analytic_critical_gain(config);
    const SampleDelay delay = split_delay(config.measurement.delay_s, config.run.sample_rate_hz);
    const auto drive =
        make_drive({config.drive, {}, {}, config.actuator.lag_s}, config.run.sample_rate_hz, delay.fraction)
            .value();
    for (const double part : {-0.01, 0.01, 0.5, 0.99, 1.01, 2.0, 100.0}) {
      auto feedback = data::pi_controller(part * critical, config.controller.integral_time_s,
                                          1.0 / config.run.sample_rate_hz);
      const auto sampled = drive->sampled(1.0);
      EXPECT_EQ(
          loop_is_unstable(sampled, delay, {config.measurement.velocity}, feedback),
          std::abs(dominant_loop_pole(sampled, delay, {config.measurement.velocity}, feedback)) > 1.0 + 1e-9)
          << name << " " << part;
    }
  }
}

TEST(Stability, ErrorNamesGainAndGrowth) {
  for (const auto& [name, config] : cases()) {
    ExperimentConfig c = config;
    const double critical = analytic_critical_gain(c);
    c.controller.gain = 1.01 * critical;
    const auto result = simulate_closed_loop(c);
    ASSERT_FALSE(result.has_value()) << name;
    EXPECT_EQ(result.error().field, "controller.gain");
    EXPECT_NE(message_of(result.error()).find("must leave the closed loop stable"), std::string::npos);
    c.controller.gain = 0.99 * critical;
    EXPECT_TRUE(simulate_closed_loop(c).has_value()) << name;
  }
}

// A belt that comes loose makes the loop unstable only later in the run: it is refused all the same.
TEST(Stability, LooksAtEveryStiffnessOfTheRun) {
  ExperimentConfig c = cases()[0].config;
  const double stiff = critical_gain([&](double gain) { return accepted(c, gain); });
  ExperimentConfig loose = c;
  loose.drive.stiffness *= 0.3;
  const double soft = critical_gain([&](double gain) { return accepted(loose, gain); });
  ASSERT_GT(std::abs(stiff / soft - 1.0), 0.02);
  c.disturbance.loosening = 0.7;
  c.disturbance.loosening_at_s = 1.0;
  const double faulty = critical_gain([&](double gain) { return accepted(c, gain); });
  EXPECT_NEAR(faulty / std::min(stiff, soft), 1.0, 1e-4);
}

// Stable at the first and the last stiffness, unstable at 0.05 times the first, which the fault passes
// through.
TEST(Stability, LooksBetweenTheEndsOfAFault) {
  ExperimentConfig c = cases()[0].config;
  c.drive = {Structure::two_mass, data::Motion::rotary, 0.00881298, 0.032, 11479.5, 0.303312, 0.0, 0.0};
  c.actuator.lag_s = 0.00121868;
  c.controller = test::pi_controller(1.0154, 0.3);
  c.measurement.delay_s = 0.00488756;
  c.run = {1000.0, 8.0, 1};
  const auto at = [&](double part) {
    ExperimentConfig fixed = c;
    fixed.drive.stiffness *= part;
    return check(fixed).has_value();
  };
  ASSERT_TRUE(at(1.0));
  ASSERT_TRUE(at(0.03));
  ASSERT_FALSE(at(0.05));
  c.disturbance.loosening = 0.97;
  c.disturbance.loosening_at_s = 1.0;
  c.disturbance.loosening_over_s = 6.0;
  EXPECT_FALSE(check(c).has_value());
}

// A resonance that hardly rings off, whose narrow peak a coarse grid would miss.
TEST(Stability, TurnsSeeNarrowResonances) {
  for (const double damping : {0.0, 5e-4})
    for (const double gain : {1e-4, 8e-4, 3e-3}) {
      const DriveConfig drive{
          Structure::two_mass, data::Motion::rotary, 0.0012, 0.0030, 600.0, damping, 0.0, 0.0};
      for (const std::size_t samples : {0U, 40U, 100U, 260U}) {
        const auto sampled = make_drive({drive, {}, {}, 0.0}, 20000.0, 0.0).value()->sampled(1.0);
        const auto feedback = data::pi_controller(gain, 0.5, 1.0 / 20000.0);
        const SampleDelay delay{samples, 0.0};
        EXPECT_EQ(
            loop_is_unstable(sampled, delay, {VelocitySource::sensor}, feedback),
            std::abs(dominant_loop_pole(sampled, delay, {VelocitySource::sensor}, feedback)) > 1.0 + 1e-9)
            << damping << " " << gain << " " << samples;
      }
    }
}

// The gain margin of the true loop is what the gain may grow by until the check refuses it.
TEST(Stability, TrueLoopHasTheMarginThatTheCheckGrants) {
  for (const double delay_s : {0.0, 0.002, 0.004, 0.0059})
    for (const auto velocity : {VelocitySource::sensor, VelocitySource::encoder}) {
      ExperimentConfig c = cases()[0].config;
      c.drive = {Structure::two_mass, data::Motion::rotary, 0.0025, 0.0060, 700.0, 0.3, 0.0, 0.0};
      c.run = {250.0, 1.0, 1};
      c.measurement.delay_s = delay_s;
      c.measurement.velocity = velocity;
      const double critical = critical_gain([&](double gain) { return accepted(c, gain); });
      c.controller.gain = 0.5 * critical;
      const auto loop = simulate_closed_loop(c).value().truth.loop;
      double least = 0.0;  // most negative crossing of the real axis
      for (std::size_t i = 1; i < loop.lines(); ++i) {
        const auto a = loop.value[i - 1];
        const auto b = loop.value[i];
        if (a.imag() * b.imag() < 0.0 && a.real() < 0.0 && b.real() < 0.0 && std::abs(a - b) < 0.5)
          least = std::min(least, (a.real() * b.imag() - b.real() * a.imag()) / (b.imag() - a.imag()));
      }
      least = std::min(least, loop.value.back().real());
      EXPECT_NEAR(least, -0.5, 2e-3) << delay_s;
    }
}

}  // namespace
}  // namespace resonid::plant
