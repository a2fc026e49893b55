// SPDX-License-Identifier: MIT
// Every exported text is run against the design's own simulation, sample by sample.
#include "design/export.hpp"

#include <gtest/gtest.h>

#include <map>

#include "exported_runs.hpp"

namespace resonid::design {
namespace {

using test::exported_controller;
using test::exported_samples;
using test::exported_variants;
using test::simulated;

class CExport : public test::ExportedRuns {
 protected:
  /// Compiled without a warning as strict C99.
  void run(const ExportedController& exported, CNumber number, const std::string& before_step = "") {
    const auto text = to_c(exported, number);
    ASSERT_TRUE(text) << text.error().requirement;
    write("controller.h", *text);
    const std::string real = number == CNumber::in_float ? "float" : "double", name = exported.name;
    write("run.c", "#include <stdio.h>\n#include \"controller.h\"\nint main(void) {\n  " + name +
                       " c;\n  double r, y;\n  int k = 0;\n  " + name + "_init(&c);\n  " + name +
                       "_set_gains(&c, c.kp, (" + real + ")" + std::to_string(exported.controller.ki) +
                       ");\n  while (scanf(\"%lf %lf\", &r, &y) == 2) {\n" + before_step +
                       "    printf(\"%.17g\\n\", (double)" + name + "_step(&c, (" + real + ")r, (" + real +
                       ")y));\n    ++k;\n  }\n  return k == 0;\n}\n");
    write_samples(exported_samples());
    const std::string compiler = RESONID_C_COMPILER;
    const std::string flags = " -std=c99 -O1 -ffp-contract=off -Wall -Wextra -Wpedantic -Wconversion -Werror";
    ASSERT_EQ(shell("'" + compiler + "'" + flags + " run.c -o run"), 0) << *text << read("log");
    ASSERT_EQ(shell("./run < rows > torque"), 0) << read("log");
  }
};

TEST_F(CExport, IsTheDesignInDouble) {
  for (const auto& exported : exported_variants()) {
    SCOPED_TRACE(exported.name + " " + std::to_string(exported.set_point_weight));
    run(exported, CNumber::in_double);
    expect_alike(printed("torque"), simulated(exported, exported_samples()), 1e-12);
  }
}

TEST_F(CExport, IsTheDesignInFloat) {
  for (const auto& exported : exported_variants()) {
    SCOPED_TRACE(exported.name + " " + std::to_string(exported.set_point_weight));
    run(exported, CNumber::in_float);
    expect_alike(printed("torque"), simulated(exported, exported_samples()), 1e-4);
  }
}

/// New gains in the middle of a run: the torque does not jump, though the error is large.
TEST_F(CExport, ChangesGainsWithoutAJump) {
  ExportedController exported = exported_controller();
  exported.controller.ki = 0.0;
  run(exported, CNumber::in_double,
      "    if (k == 30) velocity_controller_set_gains(&c, 2.0 * c.kp, 0.0);\n"
      "    r = k < 20 ? 0.0 : 10.0;\n    y = 0.0;\n");
  const auto torque = printed("torque");
  const auto plain = simulated(exported, std::vector<test::Sample>(600, {10.0, 0.0}));
  for (std::size_t k = 20; k < 200; ++k) EXPECT_NEAR(torque[k], plain[k - 20], 1e-12) << k;
}

TEST_F(CExport, LimitsTheTorqueWithoutWindup) {
  ExportedController exported = exported_controller();
  exported.torque_limit = 0.5;
  const auto limited = simulated(exported, exported_samples());
  run(exported, CNumber::in_double);
  const auto torque = printed("torque");
  expect_alike(torque, limited, 1e-12);
  EXPECT_LE(*std::max_element(torque.begin(), torque.end()), 0.5);
  EXPECT_EQ(torque[40], 0.5);
  EXPECT_LT(torque[255], 0.0);  // a few samples after the step back: nothing was wound up
}

TEST(CExportRefusal, FloatsFarBelowTheSampleRate) {
  ExportedController exported = exported_controller();
  exported.controller.biquads = {{0.3, 0.1, 0.5}};
  EXPECT_EQ(to_c(exported, CNumber::in_float).error().field, "biquads");
  EXPECT_TRUE(to_c(exported, CNumber::in_double));
}

using StructuredTextExport = test::ExportedRuns;

TEST_F(StructuredTextExport, IsTheDesign) {
  for (const auto& exported : exported_variants()) {
    SCOPED_TRACE(exported.name + " " + std::to_string(exported.set_point_weight));
    run_structured_text(exported);
    expect_alike(printed("torque"), simulated(exported, exported_samples()), 1e-12);
  }
}

TEST_F(StructuredTextExport, GivesNoTorqueAtAnotherCycleTimeOrDisabled) {
  for (const char* more : {" 0.002 1", " 0.001 0"}) {
    run_structured_text(exported_controller(), more);
    for (const double torque : printed("torque")) EXPECT_EQ(torque, 0.0);
    EXPECT_EQ(read("torque").find("0.0 1") != std::string::npos, std::string(more) == " 0.002 1");
  }
}

class HalExport : public test::ExportedRuns {
 protected:
  /// Nothing where LinuxCNC is not here.
  std::optional<std::vector<double>> run(const ExportedController& exported) {
    const auto text = to_hal(exported);
    EXPECT_TRUE(text);
    write("controller.hal", *text);
    write_samples(exported_samples());
    const int code =
        shell(std::string("'") + RESONID_PYTHON + "' '" + RESONID_DESIGN_TESTS + "/hal_run.py' '" +
              folder_.string() + "' " + exported.name + " 1000000 reference velocity > said");
    if (code == 77) return std::nullopt;
    EXPECT_EQ(code, 0) << *text << read("said") << read("log");
    return printed("torque");
  }
};

/// Filters as LinuxCNC's biquads of type 0 by the coefficients of a text, one after the other.
class HalFilters {
 public:
  HalFilters(const std::map<std::string, double>& settings, const std::string& prefix) {
    for (int i = 1; settings.count(prefix + std::to_string(i) + ".n0") != 0; ++i) {
      const auto value = [&](const char* pin) { return settings.at(prefix + std::to_string(i) + "." + pin); };
      filters_.push_back({value("n0"), value("n1"), value("n2"), value("d1"), value("d2")});
    }
  }
  [[nodiscard]] std::size_t size() const { return filters_.size(); }
  double step(double x) {
    for (Filter& f : filters_) {
      const double out = f.n0 * x + f.s1;
      f.s1 = f.n1 * x - f.d1 * out + f.s2;
      f.s2 = f.n2 * x - f.d2 * out;
      x = out;
    }
    return x;
  }

 private:
  struct Filter {
    double n0, n1, n2, d1, d2, s1 = 0.0, s2 = 0.0;
  };
  std::vector<Filter> filters_;
};

std::map<std::string, double> settings_in(const std::string& text) {
  std::map<std::string, double> settings;
  std::istringstream lines(text);
  std::string word, pin;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    double value = 0.0;
    if (words >> word >> pin >> value && word == "setp") settings[pin] = value;
  }
  return settings;
}

/// What the settings of a text mean by the manual page pid(9): the output is bias + Pgain error + Igain times
/// the summed error + FF0 command, each gain multiplying its own.
std::vector<double> meant_by(const std::string& text, const ExportedController& exported) {
  const auto settings = settings_in(text);
  const auto pid = [&](const char* pin) { return settings.at(exported.name + "-pid." + pin); };
  HalFilters reference(settings, exported.name + "-r"), velocity(settings, exported.name + "-v");
  EXPECT_EQ(reference.size(), exported.controller.biquads.size());
  EXPECT_EQ(velocity.size(), exported.controller.biquads.size());
  for (const char* unused : {"Dgain", "FF1", "FF2", "deadband", "maxerror", "maxerrorI", "maxoutput", "bias"})
    EXPECT_EQ(pid(unused), 0.0) << unused;
  std::vector<double> torque;
  double sum = 0.0;
  for (const auto& sample : exported_samples()) {
    const double command = reference.step(sample.reference);
    const double error = command - velocity.step(sample.velocity);
    sum += exported.sample_time_s * error;
    torque.push_back(pid("Pgain") * error + pid("Igain") * sum + pid("FF0") * command);
  }
  return torque;
}

TEST_F(HalExport, MeansTheDesignByItsSettings) {
  std::size_t weighted = 0;
  for (ExportedController exported : exported_variants()) {
    SCOPED_TRACE(exported.name + " " + std::to_string(exported.set_point_weight));
    exported.torque_limit.reset();
    const auto text = to_hal(exported);
    ASSERT_TRUE(text) << text.error().requirement;
    expect_alike(meant_by(*text, exported), simulated(exported, exported_samples()), 1e-12);
    weighted += exported.set_point_weight != 1.0 ? 1 : 0;
  }
  EXPECT_EQ(weighted, 2U);
  EXPECT_NE(to_hal(exported_controller())->find("velocity_controller-pid.FF0 0\n"), std::string::npos);
}

TEST(ExportComments, HaveNoMoreDigitsThanANumberNeeds) {
  auto controller = exported_controller();
  controller.sample_time_s = 0.0004;
  const auto block = to_structured_text(controller);
  ASSERT_TRUE(block) << block.error().requirement;
  EXPECT_NE(block->find("a task of 0.0004 s;"), std::string::npos) << *block;
  EXPECT_NE(block->find("sample_time : LREAL := 0.00040000000000000002;"), std::string::npos);
  ExportedRst law;
  law.r = {1.0, -0.9};
  law.s = {1.0, -1.0};
  law.sample_time_s = 0.0004;
  const auto rst = to_structured_text(law);
  ASSERT_TRUE(rst) << rst.error().requirement;
  EXPECT_NE(rst->find("a task of 0.0004 s;"), std::string::npos) << *rst;
}

/// What LinuxCNC's pid does at its limit, behind filters of the error: the sum stops one period later than it
/// could.
std::vector<double> simulated_hal(const ExportedController& exported) {
  const double step = exported.sample_time_s, limit = *exported.torque_limit;
  const auto filters = states_of(FilteredPi{1.0, 0.0, exported.controller.biquads}, step);
  Eigen::VectorXd of_reference = Eigen::VectorXd::Zero(filters.a.rows()), of_velocity = of_reference;
  const auto filtered = [&](Eigen::VectorXd& x, double value) {
    const double out = filters.c * x + filters.d * value;
    x = (filters.a * x + filters.b * value).eval();
    return out;
  };
  std::vector<double> torque;
  double sum = 0.0, at_limit = 0.0;
  for (const auto& sample : exported_samples()) {
    const double reference = filtered(of_reference, sample.reference);
    const double velocity = filtered(of_velocity, sample.velocity), error = reference - velocity;
    if (error * at_limit <= 0.0) sum += step * error;
    const double u = exported.controller.kp * (exported.set_point_weight * reference - velocity) +
                     exported.controller.ki * sum;
    at_limit = u > limit ? 1.0 : u < -limit ? -1.0 : 0.0;
    torque.push_back(std::clamp(u, -limit, limit));
  }
  return torque;
}

/// The sampler says six decimals.
TEST_F(HalExport, IsTheDesignInLinuxCnc) {
  for (ExportedController exported : exported_variants()) {
    SCOPED_TRACE(std::to_string(exported.set_point_weight));
    exported.name = "axis_velocity_control";  // as long as a name may be
    const auto torque = run(exported);
    if (!torque) GTEST_SKIP() << read("said");
    expect_alike(*torque,
                 exported.torque_limit ? simulated_hal(exported) : simulated(exported, exported_samples()),
                 1e-6);
  }
}

TEST_F(HalExport, RefusesWhatPidDoesNotKnow) {
  ExportedController exported = exported_controller();
  exported.set_point_weight = 0.5;
  exported.kv = 3.0;
  EXPECT_EQ(to_hal(exported).error().field, "set_point_weight");
  exported = exported_controller();
  exported.name += "_of_x";
  EXPECT_EQ(to_hal(exported).error().field, "name");
  exported = exported_controller();
  EXPECT_EQ(to_hal(exported, "two words").error().field, "thread");
  exported.sample_time_s = 1.23456e-5;
  EXPECT_EQ(to_hal(exported).error().field, "sample_time_s");
  exported.sample_time_s = 1.0 / 3000.0;  // 333333 ns is as near as no matter
  EXPECT_TRUE(to_hal(exported));
}

TEST(Export, RefusesWhatIsNoController) {
  const auto refused = [](auto change) {
    ExportedController exported = exported_controller();
    change(exported);
    const auto c = to_c(exported, CNumber::in_double), text = to_structured_text(exported),
               hal = to_hal(exported);
    EXPECT_FALSE(c || text || hal);
    return c ? std::string() : c.error().field.str();
  };
  for (const char* name : {"", "2nd", "a b", "a__b", "a_", "_a", "While", "torque", "x", "position", "way"})
    EXPECT_EQ(refused([&](auto& e) { e.name = name; }), "name") << name;
  EXPECT_EQ(refused([](auto& e) { e.sample_time_s = 0.0; }), "sample_time_s");
  EXPECT_EQ(refused([](auto& e) { e.controller.kp = NAN; }), "kp");
  EXPECT_EQ(refused([](auto& e) { e.controller.ki = -1.0; }), "ki");
  EXPECT_EQ(refused([](auto& e) { e.set_point_weight = 1.5; }), "set_point_weight");
  EXPECT_EQ(refused([](auto& e) { e.torque_limit = 0.0; }), "torque_limit");
  EXPECT_EQ(refused([](auto& e) { e.controller.biquads[0].frequency_hz = 500.0; }), "biquads");
  EXPECT_EQ(refused([](auto& e) { e.controller.biquads[0].denominator_damping = 0.0; }), "biquads");
  EXPECT_EQ(refused([](auto& e) { e.kv = -1.0; }), "kv");
  EXPECT_EQ(refused([](auto& e) { e.sums_velocity = true; }), "sums_velocity");
  EXPECT_EQ(refused([](auto& e) {
              e.kv = 3.0;
              e.set_point_weight = 0.9;
            }),
            "set_point_weight");
  EXPECT_EQ(refused([](auto& e) { e.schedule = {{0.0, 1.0, 1.0}}; }), "kp");
  const auto schedule_refused = [&](std::vector<ScheduleNode> nodes) {
    return refused([&](auto& e) {
      e.controller.kp = e.controller.ki = 0.0;
      e.schedule = nodes;
    });
  };
  EXPECT_EQ(schedule_refused({{0.0, 1.0, 1.0}, {0.0, 2.0, 1.0}}), "schedule");
  EXPECT_EQ(schedule_refused({{0.0, -1.0, 1.0}}), "schedule");
  EXPECT_EQ(schedule_refused({{0.0, 1.0, NAN}}), "schedule");
  EXPECT_EQ(schedule_refused({{INFINITY, 1.0, 1.0}}), "schedule");
}

TEST(KlipperExport, SaysTheShaperOfEachAxis) {
  const auto text =
      to_klipper({{"x", {ShaperKind::mzv}, {{53.9, 0.01}}}, {"y", {ShaperKind::ei}, {{41.25, 0.06}}}});
  ASSERT_TRUE(text) << text.error().requirement;
  EXPECT_EQ(*text,
            "[input_shaper]\n"
            "shaper_type_x: mzv\nshaper_freq_x: 53.9\ndamping_ratio_x: 0.01\n"
            "# y: Klipper's own impulses for damped modes, of the same width\n"
            "shaper_type_y: ei\nshaper_freq_y: 41.25\ndamping_ratio_y: 0.06\n");
}

TEST(KlipperExport, RefusesWhatItCannotSay) {
  const ShapedMode mode{50.0, 0.1};
  EXPECT_EQ(to_klipper({}).error().field, "axes");
  EXPECT_EQ(to_klipper({{"a", {ShaperKind::zv}, {mode}}}).error().field, "axis");
  EXPECT_EQ(to_klipper({{"x", {ShaperKind::zv}, {mode}}, {"x", {ShaperKind::zv}, {mode}}}).error().field,
            "axis");
  EXPECT_EQ(to_klipper({{"x", {ShaperKind::zv, ShaperKind::zv}, {mode, mode}}}).error().field, "modes");
  EXPECT_EQ(to_klipper({{"x", {ShaperKind::ei}, {mode}, 0.1}}).error().field, "limit");
  EXPECT_EQ(to_klipper({{"x", {ShaperKind::ei}, {{50.0, 0.5}}}}).error().field, "damping_ratio");
  EXPECT_TRUE(to_klipper({{"x", {ShaperKind::zv}, {{50.0, 0.5}}, 0.1}}));
}

}  // namespace
}  // namespace resonid::design
