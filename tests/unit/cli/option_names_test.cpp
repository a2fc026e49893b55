// SPDX-License-Identifier: MIT
#include <gtest/gtest.h>

#include <cli/option_names.hpp>
#include <cmath>

namespace resonid::cli {
namespace {

TEST(OptionNames, AreFieldsWithoutTheirUnit) {
  EXPECT_EQ(option_name("from_hz"), "--from");
  EXPECT_EQ(option_name("phases_rad"), "--phases");
  EXPECT_EQ(option_name("register_length"), "--register-length");
  EXPECT_EQ(option_name("drift_per_s"), "--drift");
  EXPECT_EQ(option_name("records"), "--join");
  EXPECT_EQ(option_unit("from_hz"), "HZ");
}

TEST(OptionNames, StandInTextsInPlaceOfFields) {
  EXPECT_EQ(in_options("give .controller."), "give --controller.");
  EXPECT_EQ(in_options("(.model auto) or .model none"), "(--model auto) or --model none");
  EXPECT_EQ(in_options("resonid plan .model RESULT.json .accuracy stiffness=1%"),
            "resonid plan --model RESULT.json --accuracy stiffness=1%");
  EXPECT_EQ(in_options("(several recordings: join())"), "(several recordings: --join)");
  EXPECT_EQ(in_options("in the part chosen with .from_s and .to_s"),
            "in the part chosen with --from and --to");
}

TEST(OptionNames, TellTheOperandToThoseWhoAreToGiveIt) {
  EXPECT_EQ(in_options("give .time or .sample_rate_hz; columns: u"),
            "give --time COL or --sample-rate HZ; columns: u");
  EXPECT_EQ(in_options("column 'x' (.input) or none"), "column 'x' (--input) or none");
  EXPECT_EQ(in_options("give .sample_rate_hz with .time none"), "give --sample-rate HZ with --time none");
}

TEST(OptionNames, LeaveOtherTextAlone) {
  for (const char* text : {"e.toml:5:18: drive.input", "./time.csv", "0.5 ... 3 Hz.", "ends.", "", ".",
                           ".unknown_field", "rejoin() it"})
    EXPECT_EQ(in_options(text), text);
}

TEST(OptionNames, OfAnErrorStandBeforeIt) {
  EXPECT_EQ(in_options(Error{"delay_s", "must be >= 0", -1.0}), "--delay: found -1, must be >= 0");
  EXPECT_EQ(in_options(Error{{}, "is empty", std::nan(""), "run.csv"}), "run.csv: is empty");
}

}  // namespace
}  // namespace resonid::cli
