// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <publication_v.hpp>
#include <string>

namespace resonid::test {
namespace {

constexpr int kSeeds = 20;

void record(const ResonanceErrors& e) {
  testing::Test::RecordProperty("at_label_percent", std::to_string(e.at_label));
  testing::Test::RecordProperty("at_centre_percent", std::to_string(e.at_centre));
  testing::Test::RecordProperty("at_end_percent", std::to_string(e.at_end));
  testing::Test::RecordProperty("largest_percent", std::to_string(e.largest));
}

// The oracle's 0.89 % rms at the window's centre.
TEST(PublicationV, PublishedConfiguration) {
  const auto e =
      resonance_errors({.step_hz = 5.0, .window = online::DftWindow::rectangular, .levy = true}, 101, kSeeds);
  record(e);
  EXPECT_NEAR(e.at_centre, 0.89, 0.03);
}

TEST(PublicationV, BestConfiguration) {
  const auto e = resonance_errors({}, 101, kSeeds);
  record(e);
  EXPECT_LE(e.at_label, 0.17);
}

TEST(PublicationV, LineByLine) {
  const auto e = resonance_errors({.line_by_line = true}, 101, kSeeds);
  record(e);
  EXPECT_LE(e.at_label, 0.17);
}

}  // namespace
}  // namespace resonid::test
