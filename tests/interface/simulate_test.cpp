// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <golden.hpp>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/table.hpp>

#include "program.hpp"

namespace resonid {
namespace {

class Simulate : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    demo_ = test::text_of(std::string(RESONID_EXPERIMENTS_DIR) + "/demo.toml");
  }
  /// The demo with one piece of text replaced.
  void write_demo(const std::string& from = "", const std::string& to = "") const {
    std::string text = demo_;
    if (!from.empty()) {
      ASSERT_NE(text.find(from), std::string::npos) << from;
      text.replace(text.find(from), from.size(), to);
    }
    write("e.toml", text);
  }
  void expect_file_refused(const std::string& from, const std::string& to,
                           std::initializer_list<const char*> words) {
    write_demo(from, to);
    expect_refused("simulate e.toml --out r.csv", words);
    EXPECT_FALSE(std::filesystem::exists(path("r.csv")));
  }

 private:
  std::string demo_;
};

// The date is that of `date -u -d @86400`.
TEST_F(Simulate, ResultsNameVersionCommandDateAndFiles) {
  write_demo();
  ASSERT_EQ(run("simulate e.toml --duration 2 --out r.csv").exit_code, 0);
  const auto identify = [&] {
    const auto done = run("identify r.csv --model none --json o.json --report 'o o.html'");
    EXPECT_EQ(done.exit_code, 0) << done.error;
    return nlohmann::json::parse(text("o.json")).at("provenance");
  };
  ::setenv("SOURCE_DATE_EPOCH", "86400", 1);
  const auto made = identify();
  const std::string result = text("o.json"), page = text("o o.html");
  EXPECT_EQ(identify(), made);
  EXPECT_EQ(text("o.json"), result);  // the same again, to the byte
  EXPECT_EQ(text("o o.html"), page);
  ::unsetenv("SOURCE_DATE_EPOCH");
  EXPECT_EQ(made.at("date"), "1970-01-02T00:00:00Z");
  EXPECT_EQ(made.at("command"), "resonid identify r.csv --model none --json o.json --report 'o o.html'");
  EXPECT_EQ(run("--version").out, "resonid " + made.at("version").get<std::string>() + "\n");
  EXPECT_EQ(made.at("files").at(0).at("name"), "r.csv");
  EXPECT_EQ(made.at("files").at(0).at("sha256").get<std::string>().size(), 64U);
  EXPECT_NE(page.find(made.at("files").at(0).at("sha256").get<std::string>()), std::string::npos);
  EXPECT_GT(identify().at("date").get<std::string>(), "2020");  // the clock's
}

TEST_F(Simulate, DemoWritesRecordTruthAndSummary) {
  write_demo();
  const auto done = run("simulate e.toml --out r.csv --truth t.json --json s.json --report p.html");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("resonance 15.09 Hz"), std::string::npos) << done.out;
  const auto page = text("p.html");
  for (const char* part : {"Two-mass drive, simulated", "resonid simulate e.toml", "15.09", "phase margin",
                           "Magnitude", "Excitation", "Output"})
    EXPECT_NE(page.find(part), std::string::npos) << part;
  const auto table = io::read_csv(path("r.csv"));
  ASSERT_TRUE(table.has_value());
  EXPECT_EQ(table->names, (std::vector<std::string>{"time_s", "ru", "u", "y", "r"}));
  EXPECT_EQ(table->columns[0].size(), 8500U);
  const auto truth = nlohmann::json::parse(text("t.json"));
  EXPECT_EQ(truth.at("seed"), 1);
  EXPECT_EQ(truth.at("delay_s"), 0.004);
  EXPECT_EQ(truth.at("model").at("structure"), "two-mass");
  const auto& parameters = truth.at("model").at("parameters");
  EXPECT_NEAR(parameters.at("stiffness").at("value").get<double>(), 143.75, 1e-9);
  EXPECT_EQ(parameters.at("stiffness").at("unit"), "Nm/rad");
  EXPECT_NEAR(parameters.at("damping").at("value").get<double>(), 0.3, 1e-12);
  EXPECT_EQ(truth.at("resonances")[0].at("kind"), "antiresonance");
  EXPECT_NEAR(truth.at("resonances")[1].at("frequency_hz").get<double>(), 15.0856513721, 1e-9);
  EXPECT_EQ(truth.at("model").at("transfer_function").at("sample_time_s"), 0.002);
  EXPECT_EQ(truth.at("frequency_response").at("real").size(), 200U);
  const auto summary = nlohmann::json::parse(text("s.json"));
  EXPECT_EQ(summary.at("samples"), 8500);
  EXPECT_NEAR(summary.at("signals").at("y").at("mean").get<double>(), 10.0, 0.05);
}

TEST_F(Simulate, TrueMarginsAreThoseOfTheDesign) {
  write("e.toml",
        "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = 143.75, damping = 0.3}\n"
        "controller = {kind = 'pi', gain = 1.03598193204, integral_time_s = 0.147023908851}\n"
        "excitation = {kind = 'multisine', lines_hz = '2.9:23.9:3'}\n"
        "measurement = {delay_s = 0.004}\nrun = {sample_rate_hz = 500}\n");
  const auto done = run("simulate e.toml --truth -");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto truth = nlohmann::json::parse(done.out);
  const auto golden = test::golden_json("models.json").at("pi_design_nd2").at("margins");
  EXPECT_NEAR(truth.at("loop").at("crossover_hz").get<double>(), golden.at("fc").get<double>(), 1e-4);
  EXPECT_NEAR(truth.at("loop").at("phase_margin_deg").get<double>(), golden.at("Pm").get<double>(), 1e-3);
  EXPECT_NEAR(truth.at("loop").at("modulus_margin").get<double>(), golden.at("Mm_all").get<double>(), 1e-4);
  EXPECT_EQ(truth.at("frequency_response").at("frequency_hz").size(), 8U);
}

TEST_F(Simulate, SameSeedSameBytes) {
  write_demo();
  ASSERT_EQ(run("simulate e.toml --out a.csv --seed 7").exit_code, 0);
  ASSERT_EQ(run("simulate e.toml --out b.csv --seed 7").exit_code, 0);
  ASSERT_EQ(run("simulate e.toml --out c.csv").exit_code, 0);
  ASSERT_EQ(run("simulate e.toml --out d.csv --seed 1").exit_code, 0);
  EXPECT_EQ(text("a.csv"), text("b.csv"));
  EXPECT_NE(text("a.csv"), text("c.csv"));
  EXPECT_EQ(text("c.csv"), text("d.csv"));
}

TEST_F(Simulate, LinesOfTheTruthCanBeChosen) {
  write_demo();
  ASSERT_EQ(run("simulate e.toml --truth t.json --lines 2:33:1").exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(text("t.json")).at("frequency_response").at("frequency_hz").size(), 32U);
  expect_refused("simulate e.toml --lines 200:300:50", {"--lines", "300", "half the sample rate, 250"});
}

TEST_F(Simulate, WrongFilesAreRefusedWithTheirPlace) {
  expect_refused("simulate nothing.toml", {"nothing.toml", "cannot be opened"});
  expect_refused("simulate .", {"is a folder"});
  expect_refused("simulate", {"EXPERIMENT", "required"});
  expect_file_refused(
      "delay_s = 0.004", "dealy_s = 0.004",
      {"e.toml:29:1: unknown key 'measurement.dealy_s' (did you mean 'delay_s'?)", "noise_rms"});
  expect_file_refused("[measurement]", "[mesurement]",
                      {"e.toml:28:", "'mesurement'", "did you mean 'measurement'"});
  expect_file_refused("delay_s = 0.004", "delay_s = -0.004",
                      {"e.toml:29:11: measurement.delay_s", "-0.004", ">= 0"});
  expect_file_refused("delay_s = 0.004", "delay_s = '4 ms'",
                      {"e.toml:29:11:", "found '4 ms'", "required a number"});
  expect_file_refused("from_hz = 35.0", "from_hz = 350.0",
                      {"e.toml:24:11: excitation.from_hz", "350", "below half"});
  expect_file_refused("to_hz = 1.5", "to_hz = 35.0", {"e.toml:25:9: excitation.to_hz", "band is empty"});
  expect_file_refused("kind = \"pi\"", "kind = \"pdi\"",
                      {"controller.kind", "'pdi'", "none, p, pi, pid, cascade, rst, transfer-function"});
  expect_file_refused("kind = \"chirp\"", "", {"e.toml:21:", "[excitation]", "'kind'"});
  expect_file_refused("stiffness = 5.75e4 ", "# ", {"e.toml:4:", "[drive]", "'stiffness'", "must be > 0"});
  expect_file_refused("seed = 1", "seed = -1", {"run.seed", "-1", "whole number"});
  expect_file_refused("velocity = 10.0", "velocity = inf", {"motion.velocity", "inf", "a number"});
  expect_file_refused("seed = 1", "seed = = 1", {"e.toml:34:", "is not TOML"});
  expect_file_refused(
      "gain = 1.036", "gain = 100.0",
      {"e.toml:14:8: controller.gain: found 100, must leave the closed loop stable", "an oscillation at"});
}

}  // namespace
}  // namespace resonid
