// SPDX-License-Identifier: MIT
// Controllers as options and files write them.
#include <gtest/gtest.h>

#include <resonid/base/error_text.hpp>
#include <resonid/io/controller_file.hpp>

namespace resonid::io {
namespace {

std::string refusal(const std::string& text) {
  const auto read = read_controller(text, 0.002);
  EXPECT_FALSE(read) << text;
  return read ? std::string() : message_of(read.error());
}

TEST(ControllerFile, IsAPiInShort) {
  const auto read = read_controller("pi:2,0.1", 0.002);
  ASSERT_TRUE(read) << message_of(read.error());
  EXPECT_EQ(read->structure, "pi");
  // KP (1 + Ts/TI z/(z - 1))
  EXPECT_DOUBLE_EQ(read->numerator.at(0), 2.04);
  EXPECT_DOUBLE_EQ(read->numerator.at(1), -2.0);
  EXPECT_EQ(read->denominator, std::vector<double>({1.0, -1.0}));
}

TEST(ControllerFile, HoldsWhatTheFileSays) {
  const auto bare = read_controller(R"({"numerator": [2.04, -2], "denominator": [1, -1]})", 0.002);
  ASSERT_TRUE(bare) << message_of(bare.error());
  EXPECT_EQ(bare->structure, "");
  EXPECT_TRUE(bare->reference_numerator.empty());
  EXPECT_FALSE(bare->position_gain);
  EXPECT_EQ(bare->sample_time_s, 0.002);
  const auto pid = read_controller(
      R"({"numerator": [3, -4, 1.2], "denominator": [1, -1.4, 0.4], "sample_time_s": 0.002,
          "structure": "pid", "reference_numerator": [1, -0.8], "remark": [1]})",
      0.002);
  ASSERT_TRUE(pid) << message_of(pid.error());
  EXPECT_EQ(pid->structure, "pid");
  EXPECT_EQ(pid->reference_numerator, std::vector<double>({1.0, -0.8}));
}

TEST(ControllerFile, TellsWhatItIsMadeOf) {
  const std::string law = R"("numerator": [2.04, -2], "denominator": [1, -1])";
  const auto read = read_controller(
      "{" + law +
          R"(, "gains": {"kp": 2, "ki": 20, "biquads": [{"frequency_hz": 40, "numerator_damping": 0.5,
              "denominator_damping": 1}]}, "set_point_weight": 0.5, "derivative_gain": 0.1,
              "derivative_time_s": 0.01})",
      0.002);
  ASSERT_TRUE(read) << message_of(read.error());
  ASSERT_TRUE(read->parts);
  EXPECT_EQ(read->parts->kp, 2.0);
  EXPECT_EQ(read->parts->ki, 20.0);
  ASSERT_EQ(read->parts->biquads.size(), 1U);
  EXPECT_EQ(read->parts->biquads[0].frequency_hz, 40.0);
  EXPECT_EQ(read->parts->biquads[0].numerator_damping, 0.5);
  EXPECT_EQ(read->parts->biquads[0].denominator_damping, 1.0);
  EXPECT_EQ(read->parts->set_point_weight, 0.5);
  EXPECT_EQ(read->parts->derivative_gain, 0.1);
  EXPECT_EQ(read->parts->derivative_time_s, 0.01);
  EXPECT_FALSE(read_controller("{" + law + "}", 0.002)->parts);
  EXPECT_NE(refusal("{" + law + R"(, "gains": {"kp": 2}})").find("kp and ki"), std::string::npos);
  EXPECT_NE(refusal("{" + law + R"(, "gains": {"kp": 2, "ki": 20, "biquads": [1]}})").find("biquads"),
            std::string::npos);
  EXPECT_NE(refusal("{" + law + R"(, "gains": {"kp": 2, "ki": 20}, "derivative_gain": 1})").find("both"),
            std::string::npos);
  EXPECT_NE(refusal("{" + law + R"(, "gains": {"kp": 2, "ki": 20}, "set_point_weight": "b"})")
                .find("must be a number"),
            std::string::npos);
}

/// (2.04 - 2 z^-1)((1 + 20 Ts) - z^-1)/(1 - z^-1)^2 by hand.
TEST(ControllerFile, KnowsACascadeByItsPositionGain) {
  const std::string loop =
      R"("numerator": [2.1216, -4.12, 2], "denominator": [1, -2, 1], "structure": "cascade")";
  const auto cascade = read_controller("{" + loop + R"(, "position_gain": 20})", 0.002);
  ASSERT_TRUE(cascade) << message_of(cascade.error());
  EXPECT_EQ(cascade->position_gain, 20.0);
  // Of older files the loop is known, the gain is not.
  const auto older = read_controller("{" + loop + "}", 0.002);
  ASSERT_TRUE(older) << message_of(older.error());
  EXPECT_FALSE(older->position_gain);
  EXPECT_EQ(older->numerator, cascade->numerator);
  EXPECT_NE(refusal("{" + loop + R"(, "position_gain": 25})").find("no part of"), std::string::npos);
  EXPECT_NE(refusal("{" + loop + R"(, "position_gain": 0})").find("must be a number > 0"), std::string::npos);
  EXPECT_NE(refusal("{" + loop + R"(, "position_gain": 20, "reference_numerator": [1]})").find("one of them"),
            std::string::npos);
  EXPECT_NE(
      refusal(R"({"numerator": [2.04, -2], "denominator": [1, -1], "position_gain": 20})").find("whole"),
      std::string::npos);
}

TEST(ControllerFile, RefusesKeysOfAnotherKind) {
  const std::string loop = R"({"numerator": [2.04, -2], "denominator": [1, -1], )";
  EXPECT_NE(refusal(loop + R"("sample_time_s": "2 ms"})").find("sample_time_s"), std::string::npos);
  EXPECT_NE(refusal(loop + R"("sample_time_s": 0.001})").find("0.001 s"), std::string::npos);
  EXPECT_NE(refusal(loop + R"("structure": 3})").find("structure"), std::string::npos);
  EXPECT_NE(refusal(loop + R"("reference_numerator": ["a"]})").find("reference_numerator"),
            std::string::npos);
  EXPECT_NE(refusal(loop + R"("position_gain": "20"})").find("position_gain"), std::string::npos);
  EXPECT_NE(refusal(R"({"numerator": [1], "denominator": [0, 1]})").find("begin with 0"), std::string::npos);
  EXPECT_NE(refusal("nowhere.json").find("neither"), std::string::npos);
  EXPECT_NE(refusal("{").find("not valid JSON"), std::string::npos);
}

}  // namespace
}  // namespace resonid::io
