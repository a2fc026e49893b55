// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <publication_v.hpp>

namespace resonid::test {
namespace {

// Publication V at 0.38 m/s and 0.1 rad/s of noise; 20 seeds in tests/statistics.
TEST(PublicationV, PublishedConfigurationErrsAsTheOracleSays) {
  const auto e =
      resonance_errors({.step_hz = 5.0, .window = online::DftWindow::rectangular, .levy = true}, 101, 2);
  EXPECT_NEAR(e.at_centre, 0.89, 0.05);
  EXPECT_NEAR(e.at_end, 2.2, 0.15);
}

TEST(PublicationV, HannWindowAndDescribedTimeBringItDown) {
  EXPECT_LE(resonance_errors({}, 101, 2).at_label, 0.17);
  EXPECT_LE(resonance_errors({.line_by_line = true}, 101, 2).at_label, 0.17);
}

}  // namespace
}  // namespace resonid::test
