// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <resonid/data/record.hpp>

namespace resonid::data {
namespace {

TEST(Record, PartHasItsSamplesAndKnowsWhichOfThemWereFilled) {
  Record record;
  record.source = "belt.csv";
  record.sample_rate_hz = 10.0;
  record.start_time_s = 2.0;
  record.output_quantity = OutputQuantity::position;
  record.input.name = "u";
  record.input.unit_assumed = true;
  record.input.samples = {0.0, 1.0, 2.0, 3.0, 4.0, 5.0};
  record.output.samples = {10.0, 11.0, 12.0, 13.0, 14.0, 15.0};
  record.excitation.name = "not recorded";
  record.sampling.filled = {0, 2, 3, 5};
  record.reading = {"decimal comma"};
  const auto part = part_of(record, 2, 3);
  EXPECT_EQ(part.source, record.source);
  EXPECT_EQ(part.sample_rate_hz, 10.0);
  EXPECT_DOUBLE_EQ(part.start_time_s, 2.2);
  EXPECT_EQ(part.output_quantity, OutputQuantity::position);
  EXPECT_EQ(part.input.name, "u");
  EXPECT_TRUE(part.input.unit_assumed);
  EXPECT_FALSE(part.output.unit_assumed);
  EXPECT_EQ(part.input.samples, (std::vector<double>{2.0, 3.0, 4.0}));
  EXPECT_EQ(part.output.samples, (std::vector<double>{12.0, 13.0, 14.0}));
  EXPECT_FALSE(part.excitation.present());
  EXPECT_EQ(part.sampling.filled, (std::vector<std::size_t>{0, 1}));
  EXPECT_EQ(part.reading, record.reading);
}

}  // namespace
}  // namespace resonid::data
