// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <resonid/io/shipped_experiments.hpp>
#include <tuple>

#include "experiments.hpp"
#include "track_errors.hpp"

// `track` on the tooth belt (cart at 0.06 m/s, PRBS, noise 0.1 rad/s; a memory of 0.4 s is a forgetting of
// 0.99) over twenty seeds, the start identified on the record's first part.
namespace resonid {
namespace {

struct Case {
  const char* experiment;
  identification::TrackMethod method;
  double memory_s;
  double most_rms;       // over all seeds, at the described time, after the first second
  double most_greatest;  // of any seed
};

class TwentySeeds : public ::testing::TestWithParam<Case> {};

TEST_P(TwentySeeds, ErrorOfTheResonance) {
  const Case& c = GetParam();
  auto config = io::shipped_experiment(c.experiment);
  double squares = 0.0, greatest = 0.0;
  constexpr int kSeeds = 20;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    config.run.seed = static_cast<std::uint64_t>(400 + seed);
    const auto simulation = test::simulated(config);
    auto options = test::known_to_track(config);
    options.method = c.method;
    options.memory_s = c.memory_s;
    const auto errors =
        test::errors_of(test::tracked(simulation.record, options), *simulation.truth.over_time, 1.0);
    squares += errors.rms * errors.rms;
    greatest = std::max(greatest, errors.greatest);
  }
  const double rms = std::sqrt(squares / kSeeds);
  RecordProperty("rms_percent", std::to_string(100.0 * rms));
  RecordProperty("greatest_percent", std::to_string(100.0 * greatest));
  std::printf("%s %s: rms %.3f %%, greatest %.2f %%\n", c.experiment,
              std::string(identification::name_of(c.method)).c_str(), 100.0 * rms, 100.0 * greatest);
  EXPECT_LE(rms, c.most_rms);
  EXPECT_LE(greatest, c.most_greatest);
}

using Method = identification::TrackMethod;
INSTANTIATE_TEST_SUITE_P(
    ToothBelt, TwentySeeds,
    ::testing::Values(Case{"ii_iii_tooth_prbs", Method::automatic, 0.0, 0.0018, 0.02},
                      Case{"ii_iii_tooth_prbs_2ms", Method::automatic, 0.0, 0.0020, 0.02},
                      Case{"ii_iii_tooth_prbs", Method::instrumental_variables, 0.0, 0.0032, 0.02},
                      Case{"ii_iii_tooth_prbs_2ms", Method::instrumental_variables, 0.0, 0.0032, 0.02},
                      Case{"ii_iii_tooth_prbs", Method::arx, 0.4, 0.0050, 0.03},
                      Case{"ii_iii_tooth_prbs", Method::output_error, 0.4, 0.0040, 0.05},
                      Case{"ii_iii_tooth_prbs", Method::closed_loop_output_error, 0.4, 0.0075, 0.10}));

/// Resonance, margins and gap of the loop that runs, through track with the right controller, over a hundred
/// seeds: with a start that the record's first part shows, or with a load that nobody knows and a start whose
/// stiffness is a tenth off, up or down by turns.
class Bars : public ::testing::TestWithParam<std::tuple<Method, const char*, double>> {};

TEST_P(Bars, ErrorsAndWhatTheyAreSaidToBe) {
  const auto& [method, experiment, load] = GetParam();
  auto config = io::shipped_experiment(experiment);
  config.disturbance.load_torque = load;
  const test::LoopTruth truth(config);
  test::LoopTruth::Errors errors;
  double rows = 0.0;
  constexpr std::uint64_t kSeeds = 100;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    config.run.seed = 1000 + seed;
    const auto simulation = test::simulated(config);
    auto options = test::known_to_track(config);
    options.method = method;
    options.every = static_cast<std::size_t>(0.1 * config.run.sample_rate_hz);
    options.baseline = truth.baseline();
    if (load > 0.0) options.start = test::tooth_belt_start(config, seed % 2 == 0 ? 1.1 : 0.9);
    const auto track = test::tracked(simulation.record, options);
    rows += static_cast<double>(track.rows);
    truth.add_errors(track, errors);
  }
  constexpr std::array<double, 5> kMost = {0.004, 0.02, 1.5, 0.03, 0.03};
  for (std::size_t i = 0; i < kMost.size(); ++i) {
    const auto& e = errors[i];
    std::printf("%-8s %-21s %3.1f Nm %-17s rms %.4f, normalised squared error %.2f, trusted %.3f\n",
                std::string(identification::name_of(method)).c_str(), experiment, load,
                test::LoopTruth::kNames[i], e.rms(), e.normalised(), e.rows / rows);
    EXPECT_LE(e.rms(), kMost[i]) << test::LoopTruth::kNames[i];
    EXPECT_GE(e.normalised(), 0.7) << test::LoopTruth::kNames[i];
    EXPECT_LE(e.normalised(), 1.4) << test::LoopTruth::kNames[i];
    EXPECT_GT(e.rows, 0.9 * rows) << test::LoopTruth::kNames[i];
  }
}

INSTANTIATE_TEST_SUITE_P(ToothBelt, Bars,
                         ::testing::Combine(::testing::Values(Method::physical,
                                                              Method::instrumental_variables,
                                                              Method::damped_closed_loop_output_error),
                                            ::testing::Values("ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms"),
                                            ::testing::Values(0.0, 0.5)));

/// A load that nobody knows and a start whose stiffness is a tenth off: right in every seed, or said not to
/// be, which it must not be often.
struct Follows {
  Method method;
  double most_rms;
};
class UnknownLoad : public ::testing::TestWithParam<std::tuple<Follows, const char*, double>> {};

TEST_P(UnknownLoad, RightInEverySeedOrSaidNotToBe) {
  const auto& [follows, experiment, stiffness_factor] = GetParam();
  auto config = io::shipped_experiment(experiment);
  config.disturbance.load_torque = 0.5;
  double worst = 0.0, least = 1.0;
  int untrusted = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    config.run.seed = seed;
    const auto simulation = test::simulated(config);
    auto options = test::known_to_track(config);
    options.method = follows.method;
    options.every = 5;
    options.start = test::tooth_belt_start(config, stiffness_factor);
    const auto track = test::tracked(simulation.record, options);
    if (!track.trusted) {
      ++untrusted;
      continue;
    }
    const auto errors = test::errors_of_trusted(track, *simulation.truth.over_time);
    const double share = static_cast<double>(errors.rows) / static_cast<double>(track.rows);
    worst = std::max(worst, errors.rms);
    least = std::min(least, share);
    EXPECT_LE(errors.rms, follows.most_rms) << seed;
    EXPECT_GT(share, 0.5) << seed;
  }
  std::printf("%s %s K x %.1f: worst rms %.3f %%, trusted rows %.2f at least, %d of 20 not trusted\n",
              std::string(identification::name_of(follows.method)).c_str(), experiment, stiffness_factor,
              100.0 * worst, least, untrusted);
  EXPECT_LE(untrusted, 2);
}

INSTANTIATE_TEST_SUITE_P(ToothBelt, UnknownLoad,
                         ::testing::Combine(::testing::Values(Follows{Method::physical, 0.0020},
                                                              Follows{Method::instrumental_variables, 0.0035},
                                                              Follows{Method::damped_closed_loop_output_error,
                                                                      0.0040}),
                                            ::testing::Values("ii_iii_tooth_prbs", "ii_iii_tooth_prbs_2ms"),
                                            ::testing::Values(1.1, 0.9)));

}  // namespace
}  // namespace resonid
