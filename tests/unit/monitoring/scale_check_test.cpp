// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <monitoring/scale_check.hpp>
#include <optional>
#include <random>
#include <resonid/base/error_text.hpp>
#include <resonid/plant/experiment.hpp>
#include <vector>

namespace resonid::monitoring {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSamples = 8000.0;

/// A drive with dry friction, load steps, noise and a delay. Its loop crosses over well below the resonance.
plant::ExperimentConfig some_drive(std::uint64_t seed) {
  std::mt19937_64 generator(seed);
  const auto within = [&](double low, double high) {
    return low * std::pow(high / low, std::uniform_real_distribution<double>()(generator));
  };
  plant::ExperimentConfig e;
  const double rates[] = {250.0, 500.0, 1000.0, 2000.0, 4000.0};
  const double rate = rates[seed % 5];
  const double resonance = 2.0 * 3.141592653589793 * rate * within(0.03, 0.08);
  e.drive.structure = plant::Structure::two_mass;
  e.drive.driven_inertia = within(0.002, 0.2);
  e.drive.load_inertia = e.drive.driven_inertia * within(0.3, 5.0);
  const double both = 1.0 / (1.0 / e.drive.driven_inertia + 1.0 / e.drive.load_inertia);
  const double total = e.drive.driven_inertia + e.drive.load_inertia;
  e.drive.stiffness = both * resonance * resonance;
  e.drive.damping = 2.0 * within(0.02, 0.06) * both * resonance;
  e.controller.kind = plant::ControllerKind::pi;
  const double crossover = resonance * within(0.04, 0.1);
  e.controller.gain = total * crossover;
  e.controller.integral_time_s = within(4.0, 10.0) / crossover;
  e.motion.kind = plant::MotionKind::constant;
  e.motion.velocity = within(4.0, 20.0);
  const double torque = total * crossover;  // of an rms of about 1 rad/s
  e.drive.viscous_friction = 0.02 * torque;
  e.friction.driven.coulomb = 0.3 * torque;
  e.friction.load.coulomb = 0.2 * torque;
  std::normal_distribution<double> normal;
  for (double at = 0.1; at < 1.0; at += 0.2) {
    e.disturbance.load_step_at_s.push_back(at * kSamples / rate);
    e.disturbance.load_step.push_back(0.5 * torque * normal(generator));
  }
  e.excitation.kind = seed % 2 == 0 ? online::Kind::prbs : online::Kind::multisine;
  e.excitation.amplitude = torque;
  e.excitation.register_length = 9;
  if (seed % 2 == 1) {
    std::vector<double> lines;
    for (int k = 1; k <= 30; ++k) lines.push_back(rate / 500.0 * (k < 10 ? k : 5.0 * k - 40.0));
    EXPECT_TRUE(e.excitation.lines_hz.assign(lines));
  }
  e.measurement.noise_rms = within(0.003, 0.05);
  e.measurement.delay_s = static_cast<double>(seed % 3) / rate;
  e.run = {rate, kSamples / rate, seed};
  return e;
}

/// What is told of a drive, over what is true of it.
struct Told {
  double excitation = 1.0, input = 1.0, output = 1.0, controller = 1.0, position = 1.0;
  bool knows_controller = true, knows_excitation = true;
};

/// Runs the check over a recording; a fault that any look found.
struct Seen {
  ScaleFinding finding;
  bool verified = false;
};
Seen look_at(const plant::Simulation& drive, const Told& told) {
  AxisSpec spec;
  spec.sample_rate_hz = drive.record.sample_rate_hz;
  spec.has_excitation = told.knows_excitation;
  spec.track.common.delay_s = drive.truth.delay_s;
  std::optional<data::TransferFunction> controller;
  if (told.knows_controller) {
    controller = drive.truth.controller;
    for (double& b : controller->numerator) b *= told.controller;
  }
  ScaleCheck check(spec, controller ? &*controller : nullptr);
  Seen seen;
  const auto& r = drive.record;
  for (std::size_t k = 0; k < r.samples(); ++k) {
    check.step({told.knows_excitation ? told.excitation * r.excitation.samples[k] : 0.0,
                told.input * r.input.samples[k], told.output * r.output.samples[k]},
               kNaN);
    if (check.finding().fault != ScaleFault::none) seen.finding = check.finding();
    seen.verified = seen.verified || check.verified();
  }
  return seen;
}

const std::vector<plant::Simulation>& drives() {
  static const std::vector<plant::Simulation> all = [] {
    std::vector<plant::Simulation> made;
    for (std::uint64_t seed = 1; seed <= 50; ++seed) {
      auto one = plant::simulate_closed_loop(some_drive(seed));
      if (!one) ADD_FAILURE() << seed << ": " << one.error().field.str() << ' ' << message_of(one.error());
      if (one) made.push_back(std::move(*one));
    }
    return made;
  }();
  return all;
}

TEST(ScaleCheck, RefusesNoDriveWhoseScalesAreRight) {
  ASSERT_EQ(drives().size(), 50U);
  for (const bool controller : {true, false})
    for (const bool excitation : {true, false}) {
      int verified = 0;
      for (const auto& drive : drives()) {
        Told told;
        told.knows_controller = controller;
        told.knows_excitation = excitation;
        const auto seen = look_at(drive, told);
        EXPECT_EQ(seen.finding.fault, ScaleFault::none)
            << drive.truth.seed << ' ' << controller << excitation << ": " << scale_text(seen.finding);
        verified += seen.verified ? 1 : 0;
      }
      if (excitation) {
        EXPECT_GE(verified, controller ? 50 : 45);
      }
    }
}

/// All drives show the fault, with the multiple that is true; returns on how many it is `fault`, on the
/// others it is `or_else`.
int expect_all(const Told& told, ScaleFault fault, double multiple, ScaleFault or_else) {
  int found = 0;
  for (const auto& drive : drives()) {
    const auto seen = look_at(drive, told);
    found += seen.finding.fault == fault ? 1 : 0;
    EXPECT_TRUE(seen.finding.fault == fault || seen.finding.fault == or_else)
        << drive.truth.seed << ": " << scale_text(seen.finding);
    EXPECT_FALSE(seen.verified) << drive.truth.seed;
    if (std::isnan(multiple)) continue;
    EXPECT_NEAR(seen.finding.found, multiple, std::abs(multiple) * 0.03 + 4.0 * seen.finding.std)
        << drive.truth.seed;
    EXPECT_LT(seen.finding.std, 0.08 * std::max(1.0, std::abs(multiple))) << drive.truth.seed;
  }
  return found;
}
void expect_all(const Told& told, ScaleFault fault, double multiple) {
  EXPECT_EQ(expect_all(told, fault, multiple, fault), 50);
}

TEST(ScaleCheck, FindsTheSignOfTheOutputTurnedRound) {
  Told told;
  told.output = -1.0;
  expect_all(told, ScaleFault::output_sign, -1.0);
  // Without a controller it takes lines well below the anti-resonance: longer than this for some.
  told.knows_controller = false;
  EXPECT_GE(expect_all(told, ScaleFault::output_sign, kNaN, ScaleFault::none), 45);
}

TEST(ScaleCheck, FindsTheSignOfTheInputTurnedRound) {
  Told told;
  told.input = told.excitation = -1.0;
  expect_all(told, ScaleFault::output_sign, -1.0);
}

TEST(ScaleCheck, FindsAnExcitationOfAnotherScaleOrSign) {
  for (const double scale : {0.5, 2.0, -1.0}) {
    Told told;
    told.excitation = scale;
    expect_all(told, ScaleFault::excitation, 1.0 / scale);
  }
}

TEST(ScaleCheck, FindsAControllerOfAnotherGainOrSign) {
  for (const double gain : {2.0, 0.4}) {
    Told told;
    told.controller = gain;
    expect_all(told, ScaleFault::controller, 1.0 / gain);
  }
  Told told;
  told.controller = -1.0;
  EXPECT_GE(expect_all(told, ScaleFault::controller_sign, -1.0, ScaleFault::output_sign), 45);
}

TEST(ScaleCheck, FindsAnInputOfAnotherScaleThanItsExcitation) {
  Told told;
  told.input = 2.0;
  expect_all(told, ScaleFault::input, 2.0);
}

TEST(ScaleCheck, NeedsNoExcitationWhereOnlyTheLoadMovesTheMachine) {
  auto e = some_drive(2);
  e.excitation.kind = online::Kind::none;
  e.measurement.noise_rms = 0.05;
  const auto drive = plant::simulate_closed_loop(e).value();
  Told told;
  told.knows_excitation = false;
  EXPECT_EQ(look_at(drive, told).finding.fault, ScaleFault::none);
  EXPECT_TRUE(look_at(drive, told).verified);
  told.controller = 2.0;
  EXPECT_EQ(look_at(drive, told).finding.fault, ScaleFault::controller);
  EXPECT_NEAR(look_at(drive, told).finding.found, 0.5, 0.01);
}

TEST(ScaleCheck, SaysNothingOfAControllerOfAnotherShape) {
  // The engine tells that another one runs; no key's scale explains it.
  const auto& drive = drives()[1];
  auto changed = drive;
  auto& c = *changed.truth.controller;
  c.numerator = {c.numerator[0], -0.5 * c.numerator[0], 0.3 * c.numerator[0]};
  c.denominator = {1.0, -0.9, 0.5};
  EXPECT_EQ(look_at(changed, {}).finding.fault, ScaleFault::none);
  EXPECT_FALSE(look_at(changed, {}).verified);
}

TEST(ScaleCheck, ComparesThePositionOfALinearAxisWithItsVelocity) {
  for (const double scale : {1.0, 1000.0, -1.0, 0.5}) {
    AxisSpec spec;
    spec.sample_rate_hz = 500.0;
    spec.motion = data::Motion::linear;
    spec.has_excitation = false;
    spec.has_position = true;
    ScaleCheck check(spec, nullptr);
    std::mt19937_64 generator(1);
    std::normal_distribution<double> noise(0.0, 0.01);
    double position = 0.3;
    for (int k = 0; k < 5000; ++k) {
      const double velocity = 0.5 * std::sin(6.28 * k / 900.0);
      position += velocity / 500.0;
      check.step({0.0, 0.0, velocity + noise(generator)}, scale * position);
    }
    EXPECT_EQ(check.finding().fault, scale == 1.0 ? ScaleFault::none : ScaleFault::position) << scale;
    if (scale != 1.0) {
      EXPECT_NEAR(check.finding().found, scale, 0.02 * std::abs(scale));
    }
  }
}

TEST(ScaleCheck, GivesTheSameFromItsBytesOn) {
  const auto& r = drives()[3].record;
  const auto& c = *drives()[3].truth.controller;
  AxisSpec spec;
  spec.sample_rate_hz = r.sample_rate_hz;
  ScaleCheck whole(spec, &c);
  ScaleCheck part(spec, &c);
  for (std::size_t k = 0; k < r.samples(); ++k) {
    const double y = k % 997 == 0 ? kNaN : -r.output.samples[k];
    const online::AxisSample<double> sample{r.excitation.samples[k], r.input.samples[k], y};
    whole.step(sample, kNaN);
    part.step(sample, kNaN);
    if (k % 1237 != 0) continue;
    unsigned char bytes[sizeof(ScaleCheck)];
    std::memcpy(bytes, &part, sizeof bytes);
    ScaleCheck again;
    std::memcpy(&again, bytes, sizeof bytes);
    EXPECT_TRUE(again.intact());
    part = again;
  }
  EXPECT_EQ(whole.finding().fault, ScaleFault::output_sign);
  EXPECT_EQ(whole.finding().found, part.finding().found);
  EXPECT_EQ(whole.finding().std, part.finding().std);
}

}  // namespace
}  // namespace resonid::monitoring
