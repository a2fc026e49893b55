// SPDX-License-Identifier: MIT
// Position loops and gain schedules as texts: run against the law by its definition, and against the
// controller in the drive.
#include <gtest/gtest.h>

#include <resonid/online/control.hpp>

#include "design/export.hpp"
#include "exported_runs.hpp"

namespace resonid::design {
namespace {

using test::by_definition;
using test::cascade;
using test::Column;
using test::columns_of;
using test::Meaning;
using test::position_variants;
using test::scheduled;
using test::Told;
using test::told_samples;

/// What the drive's own controller makes of it.
std::vector<double> in_the_drive(const ExportedController& exported) {
  std::vector<online::Biquad> biquads;
  std::vector<online::GainNode> nodes;
  for (const Biquad& b : exported.controller.biquads)
    biquads.push_back({b.frequency_hz, b.numerator_damping, b.denominator_damping});
  for (const ScheduleNode& node : exported.schedule) nodes.push_back({node.position, node.kp, node.ki});
  online::DriveControlConfig config;
  config.sample_rate_hz = 1.0 / exported.sample_time_s;
  config.kp = exported.controller.kp;
  config.ki = exported.controller.ki;
  config.set_point_weight = exported.set_point_weight;
  config.torque_limit = exported.torque_limit.value_or(INFINITY);
  config.biquads = biquads;
  config.schedule = nodes;
  config.kv = exported.kv;
  config.sums_velocity = exported.sums_velocity;
  auto control = online::DriveControl<double>::create(config).value();
  std::vector<double> torque;
  for (const Told& told : told_samples())
    torque.push_back(control.step({told.reference, told.velocity, told.position, told.velocity_feed_forward,
                                   exported.kv > 0.0 ? told.torque_feed_forward : 0.0}));
  return torque;
}

TEST(ExportedLaw, IsThatOfTheControllerInTheDrive) {
  for (const auto& exported : position_variants()) {
    const auto wanted = by_definition(exported), found = in_the_drive(exported);
    double most = 0.0, error = 0.0;
    for (std::size_t i = 0; i < wanted.size(); ++i) {
      most = std::max(most, std::abs(wanted[i]));
      error = std::max(error, std::abs(found[i] - wanted[i]));
    }
    EXPECT_GT(most, 0.2);
    EXPECT_LT(error, 1e-12 * most);
  }
  // The variants do reach what they are there for.
  const auto limited = by_definition(position_variants()[4]);
  EXPECT_GT(std::count(limited.begin(), limited.end(), 0.3), 20);
  EXPECT_GT(std::count(limited.begin(), limited.end(), -0.3), 20);
}

class PositionExport : public test::ExportedRuns {
 protected:
  void write_told(const std::vector<Column>& columns, const std::string& more = "") const {
    std::ostringstream rows;
    rows.precision(17);
    for (const Told& told : told_samples()) {
      for (const Column& column : columns) rows << told.*column.value << ' ';
      rows << more << '\n';
    }
    write("rows", rows.str());
  }
  void run_c(const ExportedController& exported, CNumber number) {
    const auto text = to_c(exported, number);
    ASSERT_TRUE(text) << text.error().requirement;
    const auto columns = columns_of(exported);
    const std::string real = number == CNumber::in_float ? "float" : "double";
    std::string scanned, given;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      scanned += ", &x[" + std::to_string(i) + "]";
      given += ", (" + real + ")x[" + std::to_string(i) + "]";
    }
    std::string format;
    for (std::size_t i = 0; i < columns.size(); ++i) format += "%lf ";
    write("controller.h", *text);
    write("run.c", "#include <stdio.h>\n#include \"controller.h\"\nint main(void) {\n  " + exported.name +
                       " c;\n  double x[5];\n  " + exported.name + "_init(&c);\n  while (scanf(\"" + format +
                       "\"" + scanned + ") == " + std::to_string(columns.size()) +
                       ")\n    printf(\"%.17g\\n\", (double)" + exported.name + "_step(&c" + given +
                       "));\n  return 0;\n}\n");
    write_told(columns);
    const std::string flags =
        " -std=c99 -O1 -ffp-contract=off -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Werror" +
        std::string(exported.schedule.empty() ? " -Wno-unused-function" : "");
    ASSERT_EQ(shell("'" + std::string(RESONID_C_COMPILER) + "'" + flags + " run.c -o run"), 0)
        << *text << read("log");
    ASSERT_EQ(shell("./run < rows > torque"), 0) << read("log");
  }
  void run_structured_text(const ExportedController& exported, const std::string& more = "0.001 1") {
    const auto text = to_structured_text(exported);
    ASSERT_TRUE(text) << text.error().requirement;
    const auto columns = columns_of(exported);
    write("controller.st", *text);
    write_told(columns, more);
    std::string names;
    for (const Column& column : columns) names += std::string(column.name) + " ";
    ASSERT_EQ(shell(std::string("'") + RESONID_PYTHON + "' '" + RESONID_DESIGN_TESTS +
                    "/structured_text.py' controller.st " + names + "cycle_time enable < rows > torque"),
              0)
        << *text << read("log");
  }
  /// Nothing where LinuxCNC is not here.
  std::optional<std::vector<double>> run_hal(const ExportedController& exported) {
    const auto text = to_hal(exported);
    EXPECT_TRUE(text);
    const auto columns = columns_of(exported);
    write("controller.hal", *text);
    write_told(columns);
    std::string names;
    for (const Column& column : columns) names += " " + std::string(column.name);
    std::replace(names.begin(), names.end(), '_', '-');
    const int code =
        shell(std::string("'") + RESONID_PYTHON + "' '" + RESONID_DESIGN_TESTS + "/hal_run.py' '" +
              folder_.string() + "' " + exported.name + " 1000000" + names + " > said");
    if (code == 77) return std::nullopt;
    EXPECT_EQ(code, 0) << *text << read("said") << read("log");
    return printed("torque");
  }
};

TEST_F(PositionExport, TellsTheTorqueOfAReference) {
  ExportedController exported;
  exported.controller = {2.0, 20.0, {}};
  exported.sample_time_s = 0.001;
  exported.kv = 12.0;
  exported.feed_forward = {0.064, 0.05, 0.4, 0.004};
  const auto c = to_c(exported, CNumber::in_double), st = to_structured_text(exported),
             hal = to_hal(exported);
  ASSERT_TRUE(c && st && hal);
  const std::string function = exported.name + "_torque_feed_forward";
  write("controller.h", *c);
  write("run.c",
        "#include <stdio.h>\n#include \"controller.h\"\nint main(void) {\n  double v, a;\n"
        "  while (scanf(\"%lf %lf\", &v, &a) == 2) printf(\"%.17g\\n\", " +
            function + "(v, a));\n  return 0;\n}\n");
  write("rows", "0 0\n0 3\n2 3\n-2 0.5\n");
  ASSERT_EQ(shell("'" + std::string(RESONID_C_COMPILER) +
                  "' -std=c99 -Wall -Wextra -Wconversion -Werror -Wno-unused-function run.c -o run && ./run "
                  "< rows > torque"),
            0)
      << *c << read("log");
  const std::vector<double> wanted = {0.0, 0.192, 0.192 + 0.1 + 0.4, 0.032 - 0.1 - 0.4};
  expect_alike(printed("torque"), wanted, 1e-12);
  // The interpreter knows blocks: the function's name is its result.
  std::string block = st->substr(st->find("FUNCTION " + function));
  const auto put = [&block](const std::string& words, const std::string& by) {
    ASSERT_NE(block.find(words), std::string::npos) << words;
    block.replace(block.find(words), words.size(), by);
  };
  put("FUNCTION " + function + " : LREAL",
      "FUNCTION_BLOCK f\nVAR_OUTPUT\n  torque : LREAL;\n  wrong_cycle_time : BOOL;\nEND_VAR");
  put(function + " :=", "wrong_cycle_time := FALSE;\ntorque :=");
  put("END_FUNCTION", "END_FUNCTION_BLOCK");
  write("block.st", block);
  ASSERT_EQ(shell(std::string("'") + RESONID_PYTHON + "' '" + RESONID_DESIGN_TESTS +
                  "/structured_text.py' block.st reference_velocity reference_acceleration < rows > torque"),
            0)
      << block << read("log");
  expect_alike(printed("torque"), wanted, 1e-12);
  EXPECT_NE(hal->find("times the acceleration of the reference"), std::string::npos);
  exported.kv = 0.0;  // a velocity loop takes no torque beside its own
  EXPECT_EQ(to_c(exported, CNumber::in_double)->find("torque_feed_forward"), std::string::npos);
}

TEST_F(PositionExport, SaysHowQuicklyASchedulesPositionMayMove) {
  ExportedController exported;
  exported.sample_time_s = 0.001;
  exported.schedule = {{0.4, 2.0, 20.0}, {1.6, 1.5, 12.0}};
  for (const bool known : {false, true}) {
    exported.largest_speed = known ? std::optional(0.75) : std::nullopt;
    for (const auto& text : {to_c(exported, CNumber::in_double), to_structured_text(exported)}) {
      ASSERT_TRUE(text);
      EXPECT_EQ(text->find("at up to 0.75 of its units per s") != std::string::npos, known) << *text;
    }
  }
}

TEST_F(PositionExport, CIsTheLaw) {
  for (const auto& exported : position_variants()) {
    SCOPED_TRACE(to_c(exported, CNumber::in_double).value());
    run_c(exported, CNumber::in_double);
    expect_alike(printed("torque"), by_definition(exported), 1e-12);
    run_c(exported, CNumber::in_float);
    expect_alike(printed("torque"), by_definition(exported), 1e-5);
  }
}

TEST_F(PositionExport, StructuredTextIsTheLaw) {
  for (const auto& exported : position_variants()) {
    SCOPED_TRACE(to_structured_text(exported).value());
    run_structured_text(exported);
    expect_alike(printed("torque"), by_definition(exported), 1e-12);
  }
}

TEST_F(PositionExport, StructuredTextGivesNoTorqueAtAnotherCycleTimeOrDisabled) {
  for (const auto& exported : position_variants())
    for (const char* more : {"0.002 1", "0.001 0"}) {
      run_structured_text(exported, more);
      for (const double torque : printed("torque")) EXPECT_EQ(torque, 0.0);
    }
}

/// The sampler says six decimals.
TEST_F(PositionExport, HalIsTheLawInLinuxCnc) {
  for (const auto& exported : position_variants()) {
    if (!exported.schedule.empty()) continue;
    const auto torque = run_hal(exported);
    if (!torque) GTEST_SKIP() << read("said");
    expect_alike(*torque, by_definition(exported, Meaning::hal), 1e-6);
  }
}

TEST(PositionExportRefusal, HalKnowsNoSchedule) {
  EXPECT_EQ(to_hal(scheduled()).error().field, "schedule");
  EXPECT_TRUE(to_hal(cascade(true)));
}

}  // namespace
}  // namespace resonid::design
