// SPDX-License-Identifier: MIT
// Estimators on line on a belt that moves under an unknown load: every seed, and the bars of margins and gap.
#include <gtest/gtest.h>

#include <cstdio>
#include <moving_belt.hpp>

namespace resonid {
namespace {

using Run = test::BeltErrors (*)(const test::MovingBelt&, bool);

struct Method {
  const char* name;
  Run run;
  double most_rms;  // of the resonance, in each seed
};

class EverySeed : public testing::TestWithParam<std::tuple<Method, const char*, double>> {};

TEST_P(EverySeed, FollowsTheResonance) {
  const auto& [method, experiment, factor] = GetParam();
  double worst = 0.0, least = 1.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto e = method.run(test::moving_belt(experiment, seed, factor), false);
    EXPECT_LE(e.resonance.rms(), method.most_rms) << method.name << ' ' << experiment << " seed " << seed;
    EXPECT_GT(e.trusted, 0.9 * e.rows) << seed;
    worst = std::max(worst, e.resonance.rms());
    least = std::min(least, e.trusted / e.rows);
  }
  std::printf("%s %s K x %.1f: worst seed %.3f %%, least share of trusted rows %.2f\n", method.name,
              experiment, factor, 100.0 * worst, least);
}

INSTANTIATE_TEST_SUITE_P(MovingBelt, EverySeed,
                         testing::Combine(testing::Values(Method{"physical", test::physical_on, 0.0020},
                                                          Method{"iv", test::instrumental_on, 0.0035},
                                                          Method{"damped cloe", test::damped_closed_loop_on,
                                                                 0.0040}),
                                          testing::Values("ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms"),
                                          testing::Values(1.1, 0.9)));

class Bars : public testing::TestWithParam<const char*> {};

/// Mean squared error over the claimed variance, per figure, over 100 seeds.
TEST_P(Bars, OfThePhysicalTrackerHold) {
  test::BeltErrors all;
  for (std::uint64_t seed = 1; seed <= 100; ++seed)
    all.add(test::physical_on(test::moving_belt(GetParam(), seed, seed % 2 == 0 ? 1.1 : 0.9), true));
  const struct {
    const char* name;
    const test::FigureErrors& errors;
  } figures[] = {{"resonance", all.resonance},
                 {"crossover", all.crossover},
                 {"phase margin", all.phase_margin_deg},
                 {"modulus margin", all.modulus_margin},
                 {"gap", all.gap}};
  for (const auto& f : figures) {
    std::printf("%s %s: rms %.5f, normalised %.2f\n", GetParam(), f.name, f.errors.rms(),
                f.errors.normalised());
    EXPECT_GE(f.errors.normalised(), 0.7) << f.name;
    EXPECT_LE(f.errors.normalised(), 1.4) << f.name;
  }
}

INSTANTIATE_TEST_SUITE_P(MovingBelt, Bars, testing::Values("ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms"));

}  // namespace
}  // namespace resonid
