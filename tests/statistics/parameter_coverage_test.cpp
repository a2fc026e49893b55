// SPDX-License-Identifier: MIT
// Whether the error bars of the default model are right: the published sweep over the published drive
// (Nevaranta 2016, Pub. VI, system 2) at 10 rad/s and noise 0.1 rad/s; of 200 seeds, how many 95 % intervals
// hold the truth.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid {
namespace {

constexpr int kSeeds = 200;
// Binomial(200, 0.95) lies outside 180 ... 198 with a probability of 0.3 %.
constexpr int kLeast = 180;
constexpr int kMost = 198;

plant::Simulation simulate(std::uint64_t seed) {
  plant::ExperimentConfig c;
  c.drive.driven_inertia = c.drive.load_inertia = 0.032;
  c.drive.stiffness = 143.75;
  c.drive.damping = 0.3;
  c.controller.kind = plant::ControllerKind::pi;
  c.controller.gain = 1.036;
  c.controller.integral_time_s = 0.147;
  c.excitation.kind = excitation::Kind::chirp;
  c.excitation.from_hz = 35.0;
  c.excitation.to_hz = 1.5;
  c.excitation.duration_s = 17.0;
  c.measurement.delay_s = 0.004;
  c.measurement.noise_rms = 0.1;
  c.run.sample_rate_hz = 500.0;
  c.motion = {plant::MotionKind::constant, 10.0};
  c.run.seed = seed;
  return plant::simulate_closed_loop(c).value();
}

TEST(ParameterCoverage, IntervalsOfTheModelHoldTheTruth) {
  const std::array<double, 4> truth = {0.032, 0.032, 143.75, 0.3};
  const data::TwoMassParameters drive{0.032, 0.032, 143.75, 0.3, 0.0};
  std::array<int, 6> inside{};
  identification::Options options;
  options.chirp = identification::Chirp{35.0, 1.5, 17.0};
  options.delay_s = 0.004;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto result = identification::identify(simulate(seed).record, options).value();
    ASSERT_TRUE(result.model.has_value());
    const auto& model = result.model->drive;
    const auto count = [&](std::size_t i, const fit::Estimate& e, double true_value) {
      if (std::abs(e.value - true_value) < 1.96 * e.standard_deviation) ++inside[i];
    };
    for (std::size_t i = 0; i < truth.size(); ++i)
      count(i, model.estimate(static_cast<fit::Parameter>(i)), truth[i]);
    count(4, model.resonance(), data::resonance_hz(drive));
    count(5, model.antiresonance(), data::antiresonance_hz(drive));
  }
  const std::array<const char*, 6> names = {"driven inertia", "load inertia", "stiffness",
                                            "damping",        "resonance",    "anti-resonance"};
  for (std::size_t i = 0; i < inside.size(); ++i) {
    RecordProperty(names[i], inside[i]);
    EXPECT_GE(inside[i], kLeast) << names[i];
    EXPECT_LE(inside[i], kMost) << names[i];
  }
}

}  // namespace
}  // namespace resonid
