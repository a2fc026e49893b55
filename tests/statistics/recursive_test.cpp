// SPDX-License-Identifier: MIT
// Figures of the recursive estimators over many seeds; tests/scenario/recursive_test.cpp keeps a few of them.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <string>

#include "tooth_belt_runs.hpp"

namespace resonid::recursive {
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
      const auto run = test::resting_tooth_belt(static_cast<std::uint64_t>(3000 + seed), noise, gain, 18.0);
      const double truth = run.resonance_hz.back();
      errors[0].add(test::last_resonance(test::arx(run, Forgetting::none), run), truth);
      errors[1].add(test::last_resonance(
                        test::closed_loop(run, ClosedLoopGradient::damped_filter, Forgetting::none), run),
                    truth);
      errors[2].add(test::last_resonance(test::closed_loop(run, ClosedLoopGradient::damped_filter), run),
                    truth);
      errors[3].add(test::last_resonance(test::closed_loop(run, ClosedLoopGradient::regressor), run), truth);
    }
    const std::string with = ", noise " + std::to_string(noise);
    record("ARX" + with + ", rms over error bar", errors[0].rms());
    record("ARX" + with + ", rms %", errors[0].rms_percent());
    record("CLOE damped" + with + ", rms over error bar", errors[1].rms());
    record("CLOE damped" + with + ", rms %", errors[1].rms_percent());
    record("CLOE damped, forgetting" + with + ", rms over error bar", errors[2].rms());
    record("CLOE, forgetting" + with + ", rms over error bar", errors[3].rms());
    EXPECT_GT(errors[0].rms(), 3.0);
    EXPECT_LT(errors[1].rms(), 1.3);
    EXPECT_GT(errors[1].rms(), 0.6);
    EXPECT_LT(errors[2].rms(), 1.4);
    EXPECT_GT(errors[2].rms(), 0.6);
  }
}

}  // namespace
}  // namespace resonid::recursive
