// SPDX-License-Identifier: MIT
// Biquads in floats against an independent implementation (tests/golden/e_tune_structures.json,
// "float32_biquad").
#include <gtest/gtest.h>

#include <golden.hpp>

#include "design/float_biquad.hpp"

namespace resonid::design {
namespace {

TEST(GoldenFloatBiquad, LargestErrors) {
  const auto golden = test::golden_json("e_tune_structures.json").at("float32_biquad");
  ASSERT_EQ(golden.at("rows").size(), 6U);
  for (const auto& row : golden.at("rows")) {
    SCOPED_TRACE(row.at("f_over_fs").dump());
    const auto found = float_biquad({1000.0 * row.at("f_over_fs").get<double>(), 0.1, 0.5}, 1e-3);
    EXPECT_NEAR(found.largest_error / row.at("largest_error").get<double>(), 1.0, 2e-3);
    EXPECT_NEAR(found.dc_gain_error, row.at("dc_gain_error").get<double>(), 1e-8);
    EXPECT_EQ(found.stable, row.at("stable").get<bool>());
    EXPECT_EQ(found.largest_error > kLargestFloatError, row.at("f_over_fs").get<double>() < 1e-3);
  }
}

}  // namespace
}  // namespace resonid::design
