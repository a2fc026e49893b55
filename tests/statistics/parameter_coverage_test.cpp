// SPDX-License-Identifier: MIT
// Whether the error bars of the default model are right: the published sweep over the published drive
// (Nevaranta 2016, Pub. VI, system 2) at 10 rad/s and noise 0.1 rad/s; of 200 seeds, how many 95 % intervals
// hold the truth.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <experiments.hpp>

namespace resonid {
namespace {

constexpr int kSeeds = 200;
// Binomial(200, 0.95) lies outside 180 ... 198 with a probability of 0.3 %.
constexpr int kLeast = 180;
constexpr int kMost = 198;

plant::Simulation simulate(std::uint64_t seed) {
  auto c = test::published_drive(0.1, 10.0, seed);
  test::sweep(c);
  return test::simulated(c);
}

TEST(ParameterCoverage, IntervalsOfTheModelHoldTheTruth) {
  const std::array<double, 4> truth = {0.032, 0.032, 143.75, 0.3};
  const data::TwoMassParameters drive{0.032, 0.032, 143.75, 0.3, 0.0};
  std::array<int, 6> inside{};
  identification::Options options;
  options.chirp = online::SweepLaw{35.0, 1.5, 17.0};
  options.delay_s = 0.004;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const auto result = identification::identify(simulate(seed).record, options).value();
    ASSERT_TRUE(result.model.has_value());
    const auto& model = result.model->drive;
    const auto count = [&](std::size_t i, const data::Estimate& e, double true_value) {
      if (std::abs(e.value - true_value) < 1.96 * e.std) ++inside[i];
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
