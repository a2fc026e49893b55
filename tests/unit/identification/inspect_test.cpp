// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <resonid/identification/detail/inspect.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::identification {
namespace {

/// A two-mass drive with a chirp on its torque, in open loop or under a PI controller, with noise on the
/// velocity.
data::Record chirped(bool closed) {
  plant::ExperimentConfig c;
  c.drive.driven_inertia = c.drive.load_inertia = 0.032;
  c.drive.stiffness = 143.75;
  c.drive.damping = 0.3;
  c.drive.viscous_friction = 0.05;
  c.measurement.noise_rms = 0.02;
  c.run.sample_rate_hz = 500.0;
  c.excitation.kind = online::Kind::chirp;
  c.excitation.from_hz = 35.0;
  c.excitation.to_hz = 1.5;
  c.excitation.duration_s = 10.0;
  if (closed) {
    c.controller.kind = plant::ControllerKind::pi;
    c.controller.gain = 1.036;
    c.controller.integral_time_s = 0.147;
  }
  return plant::simulate_closed_loop(c).value().record;
}

const SignalFacts& facts(const Inspection& i, const std::string& role) {
  return *std::find_if(i.signals.begin(), i.signals.end(),
                       [&](const SignalFacts& s) { return s.role == role; });
}

TEST(Inspect, TellsExcitationBandAndStrength) {
  const auto record = chirped(false);
  const auto i = inspect(record);
  ASSERT_TRUE(i) << i.error().requirement.str();
  EXPECT_NE(i->excitation.find("chirp"), std::string::npos) << i->excitation;
  EXPECT_NEAR(i->low_hz, 1.5, 0.05);
  EXPECT_NEAR(i->high_hz, 35.0, 0.5);
  double square = 0.0;
  for (const double x : record.excitation.samples) square += x * x;
  EXPECT_NEAR(i->strength, std::sqrt(square / static_cast<double>(record.samples())), 0.02 * i->strength);
  EXPECT_DOUBLE_EQ(i->duration_s, record.duration_s());
}

TEST(Inspect, TellsAClosedLoopFromAnOpenOne) {
  EXPECT_EQ(inspect(chirped(true))->loop, LoopState::closed);
  EXPECT_EQ(inspect(chirped(false))->loop, LoopState::open);
}

TEST(Inspect, TellsResolutionAndDrift) {
  auto record = chirped(false);
  for (std::size_t k = 0; k < record.samples(); ++k) {
    auto& y = record.output.samples[k];
    y = std::round((y + 5.0 * static_cast<double>(k) / static_cast<double>(record.samples())) / 0.05) * 0.05;
  }
  const auto i = inspect(record);
  EXPECT_NEAR(facts(*i, "output").step, 0.05, 1e-9);
  EXPECT_NEAR(facts(*i, "output").drift, 4.5, 0.5);
  EXPECT_EQ(facts(*i, "excitation").step, 0.0);
}

TEST(Inspect, RefusesWhatIdentifyRefuses) {
  auto record = chirped(false);
  record.excitation = {};
  record.input.samples.assign(record.samples(), 1.0);
  EXPECT_FALSE(inspect(record));
}

}  // namespace
}  // namespace resonid::identification
