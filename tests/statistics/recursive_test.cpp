// SPDX-License-Identifier: MIT
// Figures of the recursive estimators over many seeds; tests/scenario/recursive_test.cpp keeps a few of them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "tooth_belt_runs.hpp"

namespace resonid::online {
namespace {

void record(const std::string& name, double value) {
  testing::Test::RecordProperty(name, std::to_string(value));
  std::printf("%s: %.3f\n", name.c_str(), value);
}

TEST(RecursiveStatistics, TheResonanceIsFollowedAtTheDescribedTime) {
  constexpr int kSeeds = 24;
  std::array<test::Deviation, 5> at_4_ms;
  std::array<test::Deviation, 1> at_2_ms;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    const auto run = test::moving_tooth_belt(static_cast<std::uint64_t>(1000 + seed), 250.0);
    at_4_ms[0].add(test::follow(test::arx(run), run));
    at_4_ms[1].add(test::follow(test::output_error(run, OutputErrorGradient::regressor), run));
    at_4_ms[2].add(test::follow(test::output_error(run, OutputErrorGradient::filtered), run));
    at_4_ms[3].add(test::follow(test::closed_loop(run, ClosedLoopGradient::regressor), run));
    at_4_ms[4].add(test::follow(test::closed_loop(run, ClosedLoopGradient::damped_filter), run));
    const auto fast = test::moving_tooth_belt(static_cast<std::uint64_t>(2000 + seed), 500.0);
    at_2_ms[0].add(test::follow(test::closed_loop(fast, ClosedLoopGradient::damped_filter), fast));
  }
  record("ARX, 4 ms, rms %", at_4_ms[0].rms_percent());
  record("RPLR, 4 ms, rms %", at_4_ms[1].rms_percent());
  record("RPEM damped, 4 ms, rms %", at_4_ms[2].rms_percent());
  record("CLOE, 4 ms, rms %", at_4_ms[3].rms_percent());
  record("CLOE damped, 4 ms, rms %", at_4_ms[4].rms_percent());
  record("CLOE damped, 4 ms, most %", at_4_ms[4].most_percent());
  record("CLOE damped, 2 ms, rms %", at_2_ms[0].rms_percent());
  record("CLOE damped, 2 ms, most %", at_2_ms[0].most_percent());
  EXPECT_LT(at_4_ms[0].rms_percent(), 0.50);
  EXPECT_LT(at_4_ms[1].rms_percent(), 0.40);
  EXPECT_LT(at_4_ms[3].rms_percent(), 0.75);
  EXPECT_LT(at_4_ms[4].rms_percent(), 0.32);
  EXPECT_LT(at_2_ms[0].rms_percent(), 0.32);
  EXPECT_LT(at_4_ms[4].most_percent(), 2.0);
  EXPECT_LT(at_2_ms[0].most_percent(), 2.0);
}

TEST(RecursiveStatistics, ErrorBarsHoldUnderATightLoopWhereThoseOfArxDoNot) {
  constexpr int kSeeds = 100;
  for (const double noise : {0.1, 1.0}) {
    const double gain = noise == 1.0 ? 3.0 : 1.0;
    std::array<test::NormalizedError, 4> errors;
    for (int seed = 1; seed <= kSeeds; ++seed) {
      const auto run = test::constant_tooth_belt(static_cast<std::uint64_t>(3000 + seed), noise, gain, 18.0);
      const double truth = run.resonance_hz.back();
      constexpr auto kNone = Forgetting::none;
      errors[0].add(test::last_resonance(test::arx(run, kNone), run), truth);
      errors[1].add(
          test::last_resonance(test::closed_loop(run, ClosedLoopGradient::damped_filter, kNone), run), truth);
      errors[2].add(test::last_resonance(test::closed_loop(run, ClosedLoopGradient::regressor, kNone), run),
                    truth);
      errors[3].add(test::last_resonance(test::output_error(run, OutputErrorGradient::regressor), run),
                    truth);
    }
    const std::array<const char*, 4> names{"ARX", "CLOE damped", "CLOE", "RPLR, forgetting"};
    for (std::size_t i = 0; i < names.size(); ++i) {
      const std::string with = std::string(names[i]) + ", noise " + std::to_string(noise);
      record(with + ", rms over error bar", errors[i].rms());
      record(with + ", rms %", errors[i].rms_percent());
    }
    EXPECT_GT(errors[0].rms(), 2.0);
    for (std::size_t i = 1; i < names.size(); ++i) {
      EXPECT_GT(errors[i].rms(), 0.7) << names[i];
      EXPECT_LT(errors[i].rms(), 1.35) << names[i];
    }
  }
}

}  // namespace
}  // namespace resonid::online
