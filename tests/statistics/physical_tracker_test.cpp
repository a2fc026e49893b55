// SPDX-License-Identifier: MIT
// The physical tracker against the Cramer-Rao bound of the published sweep (Nevaranta 2016, Pub. VI), in one
// pass: 400 seeds, each from a start of its own, on the systems 2 and 3; and whether its covariance is right.
#include <gtest/gtest.h>

#include <cmath>
#include <physical_tracking.hpp>
#include <resonid/io/shipped_experiments.hpp>
#include <string>

namespace resonid {
namespace {

constexpr std::uint64_t kSeeds = 400;

void expect_efficient(const char* name, double least, double most, const std::array<double, 5>& bound) {
  const auto s = test::parameter_scatter(io::shipped_experiment(name), least, most, kSeeds);
  for (std::size_t i = 0; i < 5; ++i) {
    const double ratio = s.rms_percent[i] / bound[i];
    testing::Test::RecordProperty("rmse_over_bound_" + std::to_string(i), std::to_string(ratio));
    EXPECT_LT(ratio, 1.2) << i;
    EXPECT_GT(ratio, 0.85) << i;  // below the bound by chance only: the rms of 400 errors scatters by 3.5 %
  }
  testing::Test::RecordProperty("normalised_squared_error", std::to_string(s.normalised));
  EXPECT_GT(s.normalised, 0.8);
  EXPECT_LT(s.normalised, 1.3);
}

TEST(PhysicalTrackerStatistics, System2FromTenToTwentyPercentOff) {
  expect_efficient("vi_chirp_a", 0.1, 0.2, test::kSweepBoundSystem2);
}

/// Twice off, system 2, whose resonance comes late in the sweep: hardly ever does the filter settle wrongly.
TEST(PhysicalTrackerStatistics, System2FromThirtyToAHundredPercentOff) {
  const auto s = test::parameter_scatter(io::shipped_experiment("vi_chirp_a"), 0.3, 1.0, kSeeds);
  RecordProperty("astray", std::to_string(s.astray));
  EXPECT_LE(s.astray, 2U);  // one was seen
}

TEST(PhysicalTrackerStatistics, System3FromThirtyToAHundredPercentOff) {
  expect_efficient("vi_chirp_b", 0.3, 1.0, test::kSweepBoundSystem3);
}

}  // namespace
}  // namespace resonid
