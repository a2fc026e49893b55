// SPDX-License-Identifier: MIT
// What a controller that was designed for an identified machine keeps on the real one: 200 seeds of noise and
// of a delay that is known to a quarter of a sample, the published experiments (Nevaranta 2016, Publication
// VI). Draws are 2000 in place of 10 000, which the confidence is then counted on: twice as fast.
#include <gtest/gtest.h>

#include <tuned_seeds.hpp>

namespace resonid {
namespace {

identification::TuneOptions quick(identification::ControllerStructure structure) {
  identification::TuneOptions o;
  o.structure = structure;
  o.confidence = 0.95;
  o.draws = 2000;
  return o;
}

/// Of 95 % at least 184 of 200 are inside with a probability of 97.6 %; seeds are fixed. What is not trusted
/// counts against it: a delay that is told 0.2 ms wrong looks to identification like a lag that its model
/// lacks (differs-over-frequency), now and then.
void expect_kept(std::string_view experiment) {
  const auto found = test::tuned_seeds(experiment, 1, 200, quick(identification::ControllerStructure::pi));
  testing::Test::RecordProperty("found", found.text());
  EXPECT_EQ(found.unstable, 0);
  EXPECT_EQ(found.refused, 0);
  EXPECT_LE(found.worst_sensitivity, 1.05 * 1.4);
  EXPECT_LE(found.worst_load_transfer, 1.05 * 1.3);
  EXPECT_GE(found.inside, 184);
}

// 195 inside, the others by at most 0.7 % beyond; all trusted.
TEST(TuneOnTheTruth, KeepsItsBoundsAfterThePublishedSweep) { expect_kept("vi_chirp_a"); }
// 190 inside, five by at most 0.07 % beyond, five not trusted.
TEST(TuneOnTheTruth, KeepsItsBoundsAfterThePublishedPrbs) { expect_kept("vi_prbs_a"); }

/// 40 of 95 %: 34 are reached but once in 300 times. 39 are inside.
TEST(TuneOnTheTruth, KeepsItsBoundsWithAFilter) {
  const auto found =
      test::tuned_seeds("vi_chirp_a", 1, 40, quick(identification::ControllerStructure::automatic));
  testing::Test::RecordProperty("found", found.text());
  EXPECT_EQ(found.unstable, 0);
  EXPECT_EQ(found.untrusted + found.refused, 0);
  EXPECT_GE(found.inside, 34);
}

}  // namespace
}  // namespace resonid
