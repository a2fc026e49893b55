// SPDX-License-Identifier: MIT
// Every limit of the guard on a simulated live machine: with the guard the machine's own limit is never
// passed, without it it is. What the machine reaches is the simulation's truth, without noise and delay.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <functional>
#include <live_machine.hpp>
#include <resonid/online/excitation/excitation.hpp>
#include <resonid/online/excitation/guarded_excitation.hpp>
#include <resonid/online/lines/chirp_tracker.hpp>
#include <string>
#include <type_traits>
#include <vector>

namespace resonid::online {
namespace {

using test::LiveMachine;
using Guard = GuardedExcitation<double>;
constexpr double kRate = LiveMachine::kRate;

GuardedExcitationConfig plain(double amplitude = 2.0) {
  GuardedExcitationConfig c;
  c.sample_rate_hz = kRate;
  c.amplitude = amplitude;
  c.ramp_in_s = 0.5;
  c.ramp_out_s = 0.5;
  c.reaction_s = 0.004;  // delay of the measurement
  return c;
}

ExcitationConfig chirp(double amplitude, double from_hz, double to_hz, double duration_s) {
  ExcitationConfig c;
  c.kind = Kind::chirp;
  c.amplitude = amplitude;
  c.from_hz = from_hz;
  c.to_hz = to_hz;
  c.duration_s = duration_s;
  return c;
}
ExcitationConfig prbs(double amplitude) {
  ExcitationConfig c;
  c.kind = Kind::prbs;
  c.amplitude = amplitude;
  c.register_length = 10;
  c.clock_divider = 2;
  return c;
}

/// A run of a machine; the guard is left out where there is none. `at` may change machine, reference and
/// guard before each sample; `tripped` is what the host does when the guard has stopped.
struct LiveRun {
  LiveMachine machine{};
  double reference = 0.0;
  std::function<void(LiveRun&, Guard*, std::size_t)> at = [](LiveRun&, Guard*, std::size_t) {};
  std::function<void(LiveRun&)> tripped = [](LiveRun&) {};
  LiveMachine::Sample now{};

  void operator()(Guard* guard, const ExcitationConfig& excitation, double duration_s) {
    auto generator = Excitation::create(excitation, kRate).value();
    const auto samples = static_cast<std::size_t>(duration_s * kRate);
    for (std::size_t k = 0; k < samples; ++k) {
      at(*this, guard, k);
      now = machine.measure(reference);
      double x = generator.step();
      if (guard != nullptr) x = guard->step(x, {now.torque, now.velocity, now.position});
      machine.apply(x);
      if (guard != nullptr && guard->tripped()) tripped(*this);
    }
  }
};

void expect_report(const Guard& guard, StopReason reason) {
  EXPECT_EQ(guard.reason(), reason) << to_words(guard.reason());
  EXPECT_TRUE(guard.tripped());
  EXPECT_TRUE(guard.stopped());
  EXPECT_EQ(guard.injected(), 0.0);
  EXPECT_GT(std::abs(guard.report().value), std::abs(guard.report().limit) * 0.999);
  EXPECT_GT(guard.report().sample, 0U);
}

// ---- every limit ----

/// The drive trips at 8 Nm. The machine accelerates with 5 Nm while a PRBS of 4 Nm is injected.
TEST(GuardedExcitation, TorqueLimit) {
  constexpr double kMachineLimit = 8.0;
  const auto accelerate = [](LiveRun& r, Guard*, std::size_t k) {
    r.reference = k < 1500 ? 0.0 : std::min(20.0, 80.0 * static_cast<double>(k - 1500) / kRate);
  };
  LiveRun unguarded{.at = accelerate};
  unguarded(nullptr, prbs(4.0), 6.0);
  EXPECT_GT(unguarded.machine.reached().torque, kMachineLimit);

  for (const double trip_ramp_s : {0.0, 0.05}) {
    auto config = plain(4.0);
    config.torque_limit = kMachineLimit;
    config.trip_ramp_s = trip_ramp_s;
    auto guard = Guard::create(config).value();
    LiveRun guarded{.at = accelerate};
    guarded(&guard, prbs(4.0), 6.0);
    expect_report(guard, StopReason::torque);
    EXPECT_LE(guarded.machine.reached().torque, kMachineLimit);
    EXPECT_NEAR(std::abs(guard.report().limit), 0.9 * kMachineLimit, 1e-12);
  }
}

/// The machine may turn at 24 rad/s. It turns at 14 rad/s while a chirp of 18 Nm sweeps over the resonance.
TEST(GuardedExcitation, VelocityLimit) {
  constexpr double kMachineLimit = 24.0;
  const auto excitation = chirp(18.0, 5.0, 30.0, 10.0);
  const auto turn = [](LiveRun& r, Guard*, std::size_t k) {
    r.reference = std::min(14.0, 10.0 * static_cast<double>(k) / kRate);
  };
  LiveRun unguarded{.at = turn};
  unguarded(nullptr, excitation, 10.0);
  EXPECT_GT(unguarded.machine.reached().velocity, kMachineLimit);

  auto config = plain(18.0);
  config.velocity_limit = kMachineLimit;
  config.largest_acceleration = 18.0 / 0.032;
  auto guard = Guard::create(config).value();
  LiveRun guarded{.at = turn};
  guarded(&guard, excitation, 10.0);
  expect_report(guard, StopReason::velocity);
  EXPECT_LE(guarded.machine.reached().velocity, kMachineLimit);
  EXPECT_GT(guard.report().sample, 900U);  // not in the normal part of the run
}

/// The travel ends at -2 and 30 rad. The machine turns at 8 rad/s either way; the host stops it when told to,
/// with at least 40 rad/s2 (its profile has 60).
TEST(GuardedExcitation, PositionWindow) {
  for (const double direction : {1.0, -1.0}) {
    const double low = direction > 0.0 ? -2.0 : -30.0, high = low + 32.0;
    const auto turn = [direction](LiveRun& r, Guard*, std::size_t) { r.reference = 8.0 * direction; };
    LiveRun unguarded{.at = turn};
    unguarded(nullptr, prbs(2.0), 6.0);
    EXPECT_TRUE(unguarded.machine.reached().highest > high || unguarded.machine.reached().lowest < low);

    auto config = plain(2.0);
    config.position_low = low;
    config.position_high = high;
    config.deceleration = 40.0;
    config.largest_acceleration = 2.0 / 0.064;
    config.margin = 0.95;
    auto guard = Guard::create(config).value();
    LiveRun guarded{.at = [direction](LiveRun& r, Guard* g, std::size_t) {
      if (!g->tripped()) r.reference = std::min(8.0, std::abs(r.reference) + 0.1) * direction;
    }};
    guarded.tripped = [direction](LiveRun& r) {
      r.reference = direction * std::max(0.0, std::abs(r.reference) - 60.0 / kRate);
    };
    guarded(&guard, prbs(2.0), 8.0);
    expect_report(guard, StopReason::position);
    EXPECT_LE(guarded.machine.reached().highest, high);
    EXPECT_GE(guarded.machine.reached().lowest, low);
    EXPECT_LT(std::abs(guarded.machine.velocity()), 0.5);
    EXPECT_GT(std::max(guarded.machine.reached().highest, -guarded.machine.reached().lowest), 20.0);
  }
}

GuardedExcitationConfig watching_oscillation(double expected) {
  auto config = plain(1.0);
  config.oscillation_from_hz = 5.0;
  config.oscillation_least = 0.5;
  config.oscillation_expected = expected;
  config.oscillation_window_s = 0.1;
  return config;
}

/// The machine bears 20 rad/s. Beyond a gain of 9.03 times the published one the loop oscillates; the host
/// goes back to the published gain when the guard has stopped. Raised in the middle of the run, or from its
/// start; with what is normal given, or learned. What explodes faster than the excitation ramps in cannot be
/// told from it while learning: see docs/methods/guarded_excitation.md.
void expect_growth_stopped(double expected, bool from_start, double factor) {
  SCOPED_TRACE(testing::Message() << expected << " expected, " << from_start << ", gain " << factor);
  constexpr double kMachineLimit = 20.0;
  const auto raise = [&](LiveRun& r, Guard*, std::size_t k) {
    if (k == (from_start ? 0U : 1500U)) r.machine.set_gain(factor * LiveMachine::kGain);
  };
  LiveRun unguarded{.at = raise};
  unguarded(nullptr, prbs(1.0), 16.0);
  EXPECT_GT(unguarded.machine.reached().velocity, kMachineLimit);

  auto guard = Guard::create(watching_oscillation(expected)).value();
  bool safe = false;
  LiveRun guarded{.at = raise};
  guarded.tripped = [&](LiveRun& r) {
    if (!safe) r.machine.set_gain(LiveMachine::kGain);
    safe = true;
  };
  guarded(&guard, prbs(1.0), 16.0);
  expect_report(guard, StopReason::oscillation);
  EXPECT_LE(guarded.machine.reached().velocity, kMachineLimit);
  EXPECT_LT(std::abs(guarded.machine.velocity()), 0.1);
}
TEST(GuardedExcitation, OscillationThatGrowsBeyondWhatIsExpected) {
  for (const bool from_start : {false, true})
    for (const double factor : {9.2, 9.5, 11.0}) expect_growth_stopped(1.0, from_start, factor);
}
TEST(GuardedExcitation, OscillationThatGrowsBeyondWhatWasLearned) {
  for (const double factor : {9.2, 9.5, 11.0}) expect_growth_stopped(0.0, false, factor);
}
TEST(GuardedExcitation, OscillationThatGrowsWhileItLearns) {
  for (const double factor : {9.2, 9.5}) expect_growth_stopped(0.0, true, factor);
}

/// Ringing is not growing: up to 1.5 % below the limit of stability where it is stated what to expect, up to
/// 4 % where that is learned.
TEST(GuardedExcitation, NoGrowthJustBelowTheLimitOfStability) {
  const struct {
    double expected, factor;
  } runs[] = {{1.0, 1.0}, {1.0, 8.9}, {0.0, 1.0}, {0.0, 4.0}, {0.0, 8.7}};
  for (const auto& r : runs)
    for (std::uint64_t length = 8; length <= 12; ++length) {
      SCOPED_TRACE(testing::Message() << r.expected << " expected, gain " << r.factor << ", " << length);
      auto guard = Guard::create(watching_oscillation(r.expected)).value();
      auto excitation = prbs(1.0);
      excitation.register_length = length;
      LiveRun run;
      run.machine.set_gain(r.factor * LiveMachine::kGain);
      run(&guard, excitation, 20.0);
      EXPECT_EQ(guard.reason(), StopReason::none) << to_words(guard.reason());
      EXPECT_TRUE(guard.steady());
    }
}

/// A chirp over the resonance is no growth where what it reaches is stated, and the ramp in is none either.
TEST(GuardedExcitation, NoGrowthWhereAChirpMeetsTheResonance) {
  auto config = watching_oscillation(0.9);  // its velocity peaks at 1.27 rad/s
  config.oscillation_growth = 1.5;
  config.amplitude = 2.0;
  auto guard = Guard::create(config).value();
  LiveRun run;
  run(&guard, chirp(2.0, 1.0, 60.0, 8.0), 9.0);
  EXPECT_EQ(guard.reason(), StopReason::none) << to_words(guard.reason());
  EXPECT_GT(run.machine.reached().velocity, 1.2);
}

/// The machine bears 20 rad/s. The sensor dies while it turns: the controller goes on with the last value and
/// runs away. The host takes the torque off when the guard has stopped.
TEST(GuardedExcitation, LostSignal) {
  constexpr double kMachineLimit = 20.0;
  const auto lose = [](LiveRun& r, Guard*, std::size_t k) {
    r.reference = std::min(10.0, 10.0 * static_cast<double>(k) / kRate);
    if (k == 2000) {
      r.reference = 12.0;
      r.machine.stick_sensor();
    }
    if (k > 2000) r.reference = 12.0;
  };
  LiveRun unguarded{.at = lose};
  unguarded(nullptr, prbs(1.0), 10.0);
  EXPECT_GT(unguarded.machine.reached().velocity, kMachineLimit);

  auto config = plain(1.0);
  config.velocity_limit = kMachineLimit;
  config.lost_s = 0.01;
  auto guard = Guard::create(config).value();
  LiveRun guarded{.at = lose};
  guarded.tripped = [](LiveRun& r) { r.machine.coast(); };
  guarded(&guard, prbs(1.0), 10.0);
  expect_report(guard, StopReason::signal_lost);
  EXPECT_EQ(guard.report().sample, 2005U);  // 10 ms are 5 samples: the sixth is too many
  EXPECT_LE(guarded.machine.reached().velocity, kMachineLimit);
}

online::ChirpTracker<double> tracker(const ExcitationConfig& c) {
  return online::ChirpTracker<double>::create({.sample_rate_hz = kRate,
                                               .from_hz = c.from_hz,
                                               .to_hz = c.to_hz,
                                               .duration_s = c.duration_s,
                                               .lambda = 8.0})
      .value();
}

/// The coupling bears a velocity amplitude of 1 rad/s at the resonance, which a chirp of 2 Nm exceeds.
TEST(GuardedExcitation, WatchdogOnTheTrackedAmplitude) {
  constexpr double kMachineLimit = 1.0;
  const auto excitation = chirp(2.0, 4.0, 30.0, 8.0);
  LiveRun unguarded;
  unguarded(nullptr, excitation, 8.0);
  EXPECT_GT(unguarded.machine.reached().velocity, kMachineLimit);

  auto config = plain(2.0);
  config.watch_limit = kMachineLimit;
  config.margin = 0.8;
  auto guard = Guard::create(config).value();
  auto line = tracker(excitation);
  LiveRun guarded{.at = [&](LiveRun& r, Guard* g, std::size_t k) {
    if (k == 0) return;
    line.step(r.now.velocity);
    g->watch(std::abs(line.phasor()));
  }};
  guarded(&guard, excitation, 8.0);
  expect_report(guard, StopReason::watchdog_amplitude);
  EXPECT_LE(guarded.machine.reached().velocity, kMachineLimit);
}

/// The same machine; the task that tracks dies at 2 s, before the chirp comes to the resonance.
TEST(GuardedExcitation, SilentWatchdog) {
  constexpr double kMachineLimit = 1.0;
  const auto excitation = chirp(2.0, 4.0, 30.0, 8.0);
  auto config = plain(2.0);
  config.watch_limit = kMachineLimit;
  config.watch_timeout_s = 0.1;
  const auto die = [](double at_s) {
    return [at_s](LiveRun&, Guard* g, std::size_t k) {
      if (static_cast<double>(k) < at_s * kRate && k % 10 == 0 && g != nullptr) g->watch(0.3);
    };
  };
  auto without_timeout = config;
  without_timeout.watch_timeout_s = 0.0;
  auto blind = Guard::create(without_timeout).value();
  LiveRun unguarded{.at = die(2.0)};
  unguarded(&blind, excitation, 8.0);
  EXPECT_GT(unguarded.machine.reached().velocity, kMachineLimit);

  auto guard = Guard::create(config).value();
  LiveRun guarded{.at = die(2.0)};
  guarded(&guard, excitation, 8.0);
  expect_report(guard, StopReason::watchdog_silent);
  EXPECT_LE(guarded.machine.reached().velocity, kMachineLimit);
  EXPECT_NEAR(static_cast<double>(guard.report().sample), 2.1 * kRate, 11.0);
}

// ---- a normal run ----

GuardedExcitationConfig everything(double amplitude) {
  auto config = plain(amplitude);
  config.torque_limit = 8.0;
  config.velocity_limit = 10.0;
  config.position_low = -3.0;
  config.position_high = 3.0;
  config.deceleration = 30.0;
  config.largest_acceleration = amplitude / 0.064;
  config.oscillation_from_hz = 5.0;
  config.oscillation_least = 0.5;
  config.oscillation_expected = 1.2;
  config.watch_limit = 10.0;
  config.watch_timeout_s = 0.1;
  config.duration_s = 9.0;
  return config;
}

TEST(GuardedExcitation, NothingTripsInANormalRun) {
  ExcitationConfig multisine;
  multisine.kind = Kind::multisine;
  multisine.amplitude = 0.5;
  const std::array<double, 8> lines{2.9, 5.9, 8.9, 11.9, 14.9, 17.9, 20.9, 23.9};
  multisine.lines_hz.assign(lines);
  for (const auto& excitation : {prbs(2.0), chirp(2.0, 1.0, 60.0, 8.0), multisine})
    for (const bool learned : {false, true}) {
      if (learned && excitation.kind == Kind::chirp) continue;  // a resonance yet to come cannot be learned
      auto config = everything(2.0);
      if (learned) config.oscillation_expected = 0.0;
      auto guard = Guard::create(config).value();
      LiveRun run{.at = [](LiveRun& r, Guard* g, std::size_t) { g->watch(std::abs(r.now.velocity)); }};
      run(&guard, excitation, 10.0);
      EXPECT_EQ(guard.reason(), StopReason::finished) << to_words(guard.reason());
      EXPECT_FALSE(guard.tripped());
      EXPECT_TRUE(guard.stopped());
      EXPECT_EQ(guard.skipped_samples(), 0U);
    }
}

TEST(GuardedExcitation, NothingTripsOnNoise) {
  auto guard = Guard::create(everything(2.0)).value();
  plant::WhiteNoise white(5, 0.7);
  LiveMachine machine;
  for (int k = 0; k < 5000; ++k) {
    const auto now = machine.measure(0.0);
    guard.watch(now.velocity);
    machine.apply(guard.step(white.step(), {now.torque, now.velocity, now.position}));
  }
  EXPECT_EQ(guard.reason(), StopReason::finished) << to_words(guard.reason());
}

// ---- ramps ----

template <class Real>
class GuardOf : public testing::Test {};
using Reals = testing::Types<float, double>;
TYPED_TEST_SUITE(GuardOf, Reals);

TYPED_TEST(GuardOf, RampsAreRaisedCosinesWithoutAJump) {
  auto config = plain(1.0);
  config.ramp_in_s = 0.2;
  config.ramp_out_s = 0.4;
  config.duration_s = 2.0;
  auto guard = GuardedExcitation<TypeParam>::create(config).value();
  const double tolerance = sizeof(TypeParam) > 4 ? 1e-12 : 1e-6;
  for (int k = 0; k < 1100; ++k) {
    const double x = static_cast<double>(guard.step(TypeParam(1)));
    const double in = std::min(1.0, (k + 1) / 100.0), out = std::clamp((1000 - k - 1) / 200.0, 0.0, 1.0);
    const double p = std::min(in, out);
    EXPECT_NEAR(x, 0.5 * (1.0 - std::cos(kPi * p)), tolerance) << k;
  }
  EXPECT_EQ(guard.reason(), StopReason::finished);
}

TYPED_TEST(GuardOf, AStopWithinTheRampInTurnsBackWhereItIs) {
  auto config = plain(1.0);
  config.ramp_in_s = 1.0;
  config.ramp_out_s = 0.25;
  auto guard = GuardedExcitation<TypeParam>::create(config).value();
  double last = 0.0;
  for (int k = 0; k < 1000; ++k) {
    if (k == 250) guard.stop();
    const double x = static_cast<double>(guard.step(TypeParam(1)));
    EXPECT_LE(std::abs(x - last), 0.5 * kPi / 125.0 + 1e-6) << k;
    last = x;
  }
  EXPECT_EQ(guard.reason(), StopReason::requested);
  EXPECT_TRUE(guard.stopped());
  EXPECT_FALSE(guard.tripped());
}

TEST(GuardedExcitation, ATripTakesItsOwnRampAndGoesBeforeARequest) {
  auto config = plain(1.0);
  config.velocity_limit = 10.0;
  config.trip_ramp_s = 0.02;
  auto guard = Guard::create(config).value();
  for (int k = 0; k < 400; ++k) guard.step(1.0, {.velocity = 0.0});
  EXPECT_EQ(guard.injected(), 1.0);
  guard.stop();
  for (int k = 0; k < 20; ++k) guard.step(1.0, {.velocity = 0.0});
  const double before = guard.injected();
  EXPECT_EQ(guard.reason(), StopReason::requested);
  std::vector<double> x;
  for (int k = 0; k < 12; ++k) x.push_back(guard.step(1.0, {.velocity = -9.5}));
  EXPECT_EQ(guard.reason(), StopReason::velocity);
  EXPECT_EQ(guard.report().sample, 420U);
  EXPECT_EQ(guard.report().value, -9.5);
  EXPECT_EQ(guard.report().limit, -9.0);
  EXPECT_LT(x[0], before);
  EXPECT_GT(x[5], 0.0);
  EXPECT_EQ(x[9], 0.0);  // 10 samples from anywhere
  guard.stop();
  EXPECT_EQ(guard.reason(), StopReason::velocity);
}

// ---- properties ----

TEST(GuardedExcitation, NeverAboveAmplitudeNorWhatTorqueIsLeft) {
  ::setenv("RC_PARAMS", "seed=20260102 max_success=300", 0);
  EXPECT_TRUE(rc::check([] {
    auto config = plain(*rc::gen::inRange(1, 50) * 0.1);
    config.torque_limit = *rc::gen::inRange(1, 80) * 0.1;
    config.trip_ramp_s = *rc::gen::element(0.0, 0.02, 0.2);
    config.ramp_in_s = *rc::gen::element(0.0, 0.1);
    config.torque_is_total = *rc::gen::arbitrary<bool>();
    auto guard = Guard::create(config).value();
    const double level = 0.9 * config.torque_limit;
    const auto value = [](double most) {
      const int i = *rc::gen::inRange(-1000, 1004);
      return i > 1000 ? (i == 1001 ? std::nan("") : HUGE_VAL) : most * i / 1000.0;
    };
    double command = 0.0, last = 0.0;
    for (int k = 0; k < 60; ++k) {
      const double measured = value(1.05 * level);
      const double given = config.torque_is_total ? measured + last : measured;
      if (std::isfinite(measured)) command = measured;
      last = guard.step(value(20.0), {.torque = given});
      RC_ASSERT(std::abs(last) <= config.amplitude);
      RC_ASSERT(std::abs(command + last) <= std::max(level, std::abs(command)) * (1.0 + 1e-12));
    }
  }));
}

// ---- contract ----

TEST(GuardedExcitation, StaysStoppedUntilAcknowledged) {
  auto config = plain(1.0);
  config.velocity_limit = 10.0;
  auto guard = Guard::create(config).value();
  for (int k = 0; k < 300; ++k) guard.step(1.0, {.velocity = 0.0});
  EXPECT_FALSE(guard.acknowledge());  // it injects
  guard.step(1.0, {.velocity = 11.0});
  EXPECT_EQ(guard.injected(), 0.0);
  for (int k = 0; k < 1000; ++k) EXPECT_EQ(guard.step(1.0, {.velocity = 0.0}), 0.0);
  EXPECT_EQ(guard.report().sample, 300U);
  EXPECT_TRUE(guard.acknowledge());
  EXPECT_EQ(guard.reason(), StopReason::none);
  double last = 0.0;
  for (int k = 0; k < 300; ++k) {
    const double x = guard.step(1.0, {.velocity = 0.0});
    EXPECT_LE(x - last, 0.5 * kPi / 250.0 + 1e-12);
    last = x;
  }
  EXPECT_EQ(last, 1.0);
}

TEST(GuardedExcitation, InjectsNothingBeforeEverythingWatchedIsMeasured) {
  auto config = plain(1.0);
  config.velocity_limit = 10.0;
  config.torque_limit = 5.0;
  config.lost_s = 1.0;
  auto guard = Guard::create(config).value();
  for (int k = 0; k < 400; ++k) EXPECT_EQ(guard.step(1.0, {.velocity = 0.0}), 0.0);
  EXPECT_GT(guard.step(1.0, {.torque = 0.0, .velocity = 0.0}), 0.0);
  EXPECT_EQ(guard.skipped_samples(), 400U);
}

TEST(GuardedExcitation, LostSamplesAreLostSignals) {
  auto config = plain(1.0);
  config.velocity_limit = 10.0;
  config.lost_s = 0.1;
  auto guard = Guard::create(config).value();
  for (int k = 0; k < 300; ++k) guard.step(1.0, {.velocity = 0.0});
  guard.miss(50);
  EXPECT_EQ(guard.reason(), StopReason::none);
  guard.step(1.0, {.velocity = 0.0});
  guard.miss(51);
  EXPECT_EQ(guard.reason(), StopReason::signal_lost);
  EXPECT_EQ(guard.samples(), 402U);
  EXPECT_EQ(guard.skipped_samples(), 101U);
  EXPECT_EQ(guard.step(1.0, {.velocity = 0.0}), 0.0);
}

TEST(GuardedExcitation, ResetReproducesAndACopyGoesOnAlike) {
  static_assert(std::is_trivially_copyable_v<Guard>);
  auto guard = Guard::create(everything(2.0)).value();
  const auto run = [](Guard& g, int from, int to) {
    std::vector<double> x;
    for (int k = from; k < to; ++k)
      x.push_back(g.step(std::sin(0.3 * k),
                         {.torque = std::sin(0.1 * k), .velocity = std::cos(0.2 * k), .position = 0.0}));
    return x;
  };
  const auto first = run(guard, 0, 800);
  Guard copy = guard;
  EXPECT_EQ(run(guard, 800, 1200), run(copy, 800, 1200));
  guard.reset();
  EXPECT_EQ(run(guard, 0, 800), first);
}

TEST(GuardedExcitation, ReasonsHaveNames) {
  EXPECT_EQ(name_of(StopReason::watchdog_silent), "watchdog-silent");
}

TEST(GuardedExcitation, RefusesWhatCouldNotGuard) {
  const auto field = [](auto change) {
    auto config = everything(2.0);
    change(config);
    const auto guard = Guard::create(config);
    return std::string(guard ? "none" : guard.error().field);
  };
  using C = GuardedExcitationConfig;
  EXPECT_EQ(field([](C&) {}), "none");
  EXPECT_EQ(field([](C& c) { c.sample_rate_hz = 0.0; }), "sample_rate_hz");
  EXPECT_EQ(field([](C& c) { c.amplitude = std::nan(""); }), "amplitude");
  EXPECT_EQ(field([](C& c) { c.margin = 1.1; }), "margin");
  EXPECT_EQ(field([](C& c) { c.torque_limit = -1.0; }), "torque_limit");
  EXPECT_EQ(field([](C& c) { c.deceleration = 0.0; }), "deceleration");
  EXPECT_EQ(field([](C& c) { c.position_low = 5.0; }), "position_high");
  EXPECT_EQ(field([](C& c) { c.duration_s = 0.9; }), "duration_s");
  EXPECT_EQ(field([](C& c) { c.oscillation_least = 0.0; }), "oscillation_least");
  EXPECT_EQ(field([](C& c) { c.oscillation_from_hz = 250.0; }), "oscillation_from_hz");
  EXPECT_EQ(field([](C& c) { c.oscillation_growth = 1.0; }), "oscillation_growth");
  EXPECT_EQ(field([](C& c) { c.largest_acceleration = 1e6; }), "velocity_limit");
}

}  // namespace
}  // namespace resonid::online
