// SPDX-License-Identifier: MIT
#include "monitor/web/metrics.hpp"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "fake_backend.hpp"
#include "monitoring/axis_spec.hpp"
#include "sanitized.hpp"

namespace resonid::monitor::web {
namespace {

using test::an_axis;

WebCounts some_counts() { return {3, 2, 1, {{200, 10}, {404, 1}}, 100, 5}; }

std::string text_of(const std::vector<AxisStatus>& axes) {
  const test::FakeBackend backend;
  return metrics_text(axes, backend.active_alarms(), backend.status(), some_counts());
}

bool has_line(const std::string& text, const std::string& line) {
  return text.find("\n" + line + "\n") != std::string::npos;
}

TEST(WebMetrics, BaseUnitsAndLabels) {
  auto linear = an_axis("z", 2.0);
  linear.state = AxisState::stale;
  linear.alarms = 2;
  linear.motion = data::Motion::linear;
  const auto text = text_of({an_axis("x"), linear});
  for (const auto* line : {"# TYPE resonid_resonance_hertz gauge",
                           R"(resonid_resonance_hertz{axis="x"} 1)",
                           R"(resonid_resonance_hertz{axis="z"} 2)",
                           R"(resonid_resonance_std_hertz{axis="x"} 0.01)",
                           R"(resonid_stiffness_newton_meters_per_radian{axis="x"} 3)",
                           R"(resonid_stiffness_newtons_per_meter{axis="z"} 6)",
                           R"(resonid_inertia_kilogram_square_meters{axis="x",side="motor"} 4)",
                           R"(resonid_inertia_kilogram_square_meters{axis="x",side="load"} 5)",
                           R"(resonid_mass_grams{axis="z",side="load"} 10000)",
                           R"(resonid_modulus_margin_ratio{axis="x"} 9)",
                           R"(resonid_gap_ratio{axis="x"} 11)",
                           R"(resonid_trusted{axis="x"} 1)",
                           R"(resonid_estimate_timestamp_seconds{axis="x"} 1700000000)",
                           R"(resonid_axis_state{axis="x",state="following"} 1)",
                           R"(resonid_axis_state{axis="x",state="stale"} 0)",
                           R"(resonid_axis_state{axis="z",state="stale"} 1)",
                           R"(resonid_axis_state{axis="z",state="refused"} 0)",
                           R"(resonid_axis_alarms{axis="x"} 0)",
                           R"(resonid_axis_alarms{axis="z"} 2)",
                           R"(resonid_newest_sample_timestamp_seconds{axis="x"} 1700000000.5)",
                           R"(resonid_samples_total{axis="x"} 1000)",
                           R"(resonid_samples_missing_total{axis="x"} 5)",
                           R"(resonid_faults_total{axis="x",kind="clock"} 2)",
                           R"(resonid_alarms_active{severity="high"} 1)",
                           R"(resonid_alarms_active{severity="medium"} 2500)",
                           R"(resonid_alarms_active{severity="low"} 0)",
                           R"(resonid_source_lost_total{source="line-1",kind="mqtt"} 1)",
                           R"(resonid_deliveries_waiting{target="webhook"} 2)",
                           R"(resonid_delivery_failures_total{target="webhook"} 3)",
                           R"(resonid_source_faults_total{source="line-1",kind="mqtt",fault="format"} 2)",
                           R"(resonid_http_responses_total{code="404"} 1)"})
    EXPECT_TRUE(has_line(text, line)) << line;
  EXPECT_TRUE(has_line("\n" + text, R"(resonid_build_info{version="0.1.0"} 1)"));
  EXPECT_TRUE(has_line(text, fmt::format(R"(resonid_phase_margin_radians{{axis="x"}} {})",
                                         10.0 * (std::numbers::pi / 180.0))));
  EXPECT_EQ(text.find("resonid_stiffness_newtons_per_meter{axis=\"x\"}"), std::string::npos);
}

TEST(WebMetrics, WhatIsNotKnownIsAbsent) {
  AxisStatus unknown;
  unknown.name = "y";
  const auto text = text_of({unknown});
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("resonid_resonance"), std::string::npos);  // nor help of what has no sample
  EXPECT_EQ(text.find("resonid_newest_sample"), std::string::npos);
  EXPECT_TRUE(has_line(text, R"(resonid_axis_state{axis="y",state="waiting"} 1)"));
  EXPECT_TRUE(has_line(text, R"(resonid_trusted{axis="y"} 0)"));
}

TEST(WebMetrics, AlarmsThatCannotBeCountedAreAbsent) {
  const auto text = metrics_text(
      {}, unexpected<Problem>(Problem{Problem::Kind::unavailable, "store", "cannot be read"}), {}, {});
  EXPECT_EQ(text.find("resonid_alarms_active"), std::string::npos);
}

TEST(WebMetrics, EscapesLabels) {
  auto axis = an_axis("x");
  axis.faults = {{"a\"b\\c\nd\xff\xc3\xa4\xe2\x82", 1, ""}};
  EXPECT_TRUE(
      has_line(text_of({axis}), "resonid_faults_total{axis=\"x\",kind=\"a\\\"b\\\\c\\nd?\xc3\xa4??\"} 1"));
}

AxisStatus in_units(const std::string& name, data::Motion motion, const std::string& input,
                    const std::string& output) {
  monitoring::AxisSpec spec;
  spec.motion = motion;
  spec.input_unit = input;
  spec.output_unit = output;
  auto axis = an_axis(name);
  axis.motion = motion;
  axis.units = monitoring::figure_units(spec);
  return axis;
}

/// Of a current, of per cent and of units without a name.
std::vector<AxisStatus> own_units() {
  using data::Motion;
  return {in_units("nm", Motion::rotary, "", ""),       in_units("a", Motion::rotary, "A", ""),
          in_units("m", Motion::linear, "A", ""),       in_units("p", Motion::rotary, "%", ""),
          in_units("v", Motion::linear, "V", ""),       in_units("c", Motion::rotary, "A", "counts/s"),
          in_units("x", Motion::rotary, "furlongs", "")};
}

TEST(WebMetrics, NamesTellUnitsOfInputsThatAreNoTorque) {
  const auto text = text_of(own_units());
  for (const auto* line :
       {R"(resonid_stiffness_newton_meters_per_radian{axis="nm"} 3)",
        R"(resonid_stiffness_amperes_per_radian{axis="a"} 3)",
        R"(resonid_stiffness_std_amperes_per_radian{axis="a"} 0.03)",
        R"(resonid_inertia_ampere_seconds_squared_per_radian{axis="a",side="motor"} 4)",
        R"(resonid_inertia_ampere_seconds_squared_per_radian{axis="a",side="load"} 5)",
        R"(resonid_damping_ampere_seconds_per_radian{axis="a"} 6)",
        R"(resonid_coulomb_friction_amperes{axis="a"} 7)", R"(resonid_coulomb_friction_amperes{axis="m"} 7)",
        R"(resonid_load_torque_amperes{axis="a"} 8)", R"(resonid_load_force_amperes{axis="m"} 8)",
        R"(resonid_mass_ampere_seconds_squared_per_meter{axis="m",side="motor"} 4)",
        R"(resonid_stiffness_ratio_per_radian{axis="p"} 0.03)",
        R"(resonid_stiffness_volts_per_meter{axis="v"} 3)",
        R"(resonid_stiffness_own_units{axis="c",unit="A/counts"} 3)",
        R"(resonid_inertia_own_units{axis="x",side="load",unit="furlongs s2/rad"} 5)",
        R"(resonid_resonance_hertz{axis="a"} 1)"})
    EXPECT_TRUE(has_line(text, line)) << line;
  const std::string fixed = "resonid_stiffness_newton_meters_per_radian{";
  EXPECT_EQ(text.find(fixed), text.rfind(fixed)) << "of one axis alone";
  const std::string type = "# TYPE resonid_coulomb_friction_amperes gauge";
  EXPECT_EQ(text.find(type), text.rfind(type)) << "both motions are of one family";
}

TEST(WebMetrics, PromtoolFindsNothingWrong) {
  if (std::system("command -v promtool > /dev/null") != 0)
    GTEST_SKIP() << "promtool is not installed (Debian: apt install prometheus): the metrics are NOT linted";
  auto linear = an_axis("z");
  linear.motion = data::Motion::linear;
  linear.faults = {{"a\"b\\c\nd\xff", 1, ""}};
  const auto file =
      std::filesystem::temp_directory_path() / fmt::format("resonid_metrics_{}.txt", ::getpid());
  const auto lint = [&](const std::string& text) {
    std::ofstream(file, std::ios::binary) << text;
    return std::system(fmt::format("promtool check metrics < {} 2>&1", file.string()).c_str());
  };
  const auto good = text_of({an_axis("x"), linear});
  EXPECT_EQ(lint(good), 0);
  EXPECT_EQ(lint(text_of(own_units())), 0);
  EXPECT_NE(lint(good + "resonid_length_kilometers 1\n"), 0);  // it does look
  std::filesystem::remove(file);
}

TEST(WebMetrics, AThousandAxesAreQuick) {
  std::vector<AxisStatus> axes;
  for (int i = 0; i < 1000; ++i) axes.push_back(an_axis(fmt::format("axis-{}", i), 1.0 / 3.0));
  double best = 1.0;
  std::size_t size = 0;
  for (int i = 0; i < 5; ++i) {  // CPU time, the least of a few: others use the machine too
    const auto start = std::clock();
    size = text_of(axes).size();
    best = std::min(best, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
  }
  fmt::print("1000 axes: {:.1f} ms of CPU, {} kB\n", 1e3 * best, size / 1000);
  EXPECT_LT(best, RESONID_SANITIZED ? 1.0 : 0.1);
}

}  // namespace
}  // namespace resonid::monitor::web
