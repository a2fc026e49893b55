// SPDX-License-Identifier: MIT
// Whether the error bars of a physical fit to an averaged spectrum are right, though its neighbouring lines
// are correlated: 60 s of PRBS, Welch, 400 seeds that nothing was tuned on.
#include <gtest/gtest.h>

#include <response_fit_coverage.hpp>

namespace resonid {
namespace {

TEST(ResponseFitCoverage, IntervalsFromAveragedSpectraHoldTheTruth) {
  test::Coverage coverage;
  for (std::uint64_t seed = 401; seed <= 800; ++seed)
    coverage.add(test::welch_fit(test::random_minute(seed).record).model);
  for (std::size_t i = 0; i < coverage.inside.size(); ++i) {
    const double percent = 100.0 * coverage.inside[i] / coverage.seeds;
    RecordProperty(test::Coverage::kNames[i], std::to_string(percent));
    EXPECT_GE(percent, 92.0) << test::Coverage::kNames[i];
    EXPECT_LE(percent, 98.0) << test::Coverage::kNames[i];
  }
}

}  // namespace
}  // namespace resonid
