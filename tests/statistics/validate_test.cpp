// SPDX-License-Identifier: MIT
// How often `validate` doubts the true drive, and how often one of another stiffness: the published drive
// (Nevaranta 2016, Pub. VI, system 2) in closed loop, PRBS of 2.1 Nm.
#include <gtest/gtest.h>

#include <cstdio>
#include <experiments.hpp>
#include <resonid/identification/validate.hpp>
#include <string>

namespace resonid {
namespace {

plant::ExperimentConfig experiment(double seconds, double noise, double stiffness, std::uint64_t seed) {
  auto c = test::published_drive(noise, 10.0, seed);
  c.drive.stiffness *= stiffness;
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 13;
  c.excitation.amplitude = 2.1;
  c.run.duration_s = seconds;
  return c;
}

struct Verdicts {
  int seeds = 0, doubted = 0;
};

/// The model of stiffness 1 on records of a machine of another stiffness. `fitted`: a two-mass model fitted
/// to a record of the same length and noise, where it is trusted; else the true one.
Verdicts verdicts(double seconds, double noise, double stiffness, bool fitted, int seeds) {
  Verdicts v;
  for (int i = 0; i < seeds; ++i) {
    const auto c = experiment(seconds, noise, 1.0, 1000 + static_cast<std::uint64_t>(i));
    const auto own = test::simulated(c);
    auto options = test::known(c);
    identification::CandidateModel candidate;
    if (fitted) {
      options.model = identification::ModelChoice::two_mass;
      const auto result = test::identified(own.record, options);
      if (!result.model || !result.trusted) continue;
      candidate = identification::candidate_of(result);
    } else {
      candidate.transfer_function = own.truth.plant;
    }
    const auto other =
        test::simulated(experiment(seconds, noise, stiffness, 5000 + static_cast<std::uint64_t>(i)));
    const auto validation = identification::validate(other.record, candidate, {options, 25});
    if (!validation) {
      ADD_FAILURE() << validation.error().requirement;
      continue;
    }
    ++v.seeds;
    if (validation->verdict != identification::Verdict::accepted) ++v.doubted;
  }
  std::printf("K x %.2f, %g s, noise %g, %s: %d of %d doubted\n", stiffness, seconds, noise,
              fitted ? "fitted" : "true", v.doubted, v.seeds);
  return v;
}

constexpr double kSeconds[] = {1.0, 2.0, 5.0, 16.0};
constexpr double kNoise[] = {0.02, 0.1, 0.5};

TEST(Validate, SeldomDoubtsTheTrueModel) {
  for (const bool fitted : {false, true}) {
    int seeds = 0, doubted = 0;
    for (const double seconds : kSeconds)
      for (const double noise : kNoise) {
        const auto v = verdicts(seconds, noise, 1.0, fitted, fitted ? 20 : 100);
        seeds += v.seeds;
        doubted += v.doubted;
      }
    EXPECT_GT(seeds, 100);
    EXPECT_LE(static_cast<double>(doubted), 0.05 * seeds) << fitted;
  }
}

TEST(Validate, FindsAStiffnessThatIsOff) {
  for (const double stiffness : {0.95, 0.9})
    for (const double seconds : kSeconds)
      for (const double noise : kNoise) {
        const auto v = verdicts(seconds, noise, stiffness, false, 20);
        const bool long_enough = seconds >= 16.0 && noise <= 0.1;
        if (long_enough || (seconds >= 5.0 && (noise <= 0.02 || (stiffness < 0.93 && noise <= 0.1)))) {
          EXPECT_EQ(v.doubted, v.seeds);
        }
      }
}

}  // namespace
}  // namespace resonid
