// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class Compare : public test::ProgramTest {
 protected:
  /// Simulates system 2 with this stiffness and identifies it: NAME.csv and NAME.json.
  void make(const std::string& name, double stiffness, int seed, const std::string& more = "",
            double duration_s = 25.0) const {
    std::ostringstream toml;
    toml << "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = " << stiffness
         << ", damping = 0.3}\ncontroller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
         << "excitation = {kind = 'prbs', register_length = 12, amplitude = 2.1}\n"
         << "measurement = {delay_s = 0.004, noise_rms = 0.1}\n"
         << "run = {sample_rate_hz = 500, duration_s = " << duration_s << ", seed = " << seed
         << "}\nmotion = {kind = 'constant', velocity = 10.0}\n";
    write(name + ".toml", toml.str());
    const auto simulated = run("simulate " + name + ".toml --out " + name + ".csv");
    ASSERT_EQ(simulated.exit_code, 0) << simulated.error;
    const auto identified =
        run("identify " + name + ".csv --controller pi:1.036,0.147 --delay 0.004 --json " + name +
            ".json --excitation-type other" + more);
    ASSERT_EQ(identified.exit_code, 0) << identified.error;
  }
  static const json& named(const json& list, const std::string& name) {
    for (const auto& d : list)
      if (d.at("name") == name) return d;
    throw std::runtime_error("no " + name + " in " + list.dump());
  }
};

TEST_F(Compare, FindsALossOfStiffnessAndNothingElse) {
  make("before", 143.75, 1);
  make("after", 0.95 * 143.75, 2);
  const auto done =
      run("compare before.json after.json --controller pi:1.036,0.147 --json c.json --report c.html");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("Stiffness fell by"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("Changed."), std::string::npos);
  const auto c = json::parse(text("c.json"));
  EXPECT_EQ(c.at("schema"), "resonid.comparison/1");
  EXPECT_TRUE(c.at("changed"));
  EXPECT_TRUE(c.at("trusted"));
  const auto& stiffness = named(c.at("parameters"), "stiffness");
  EXPECT_NEAR(stiffness.at("relative").get<double>(), -0.05,
              4.0 * stiffness.at("std").get<double>() / stiffness.at("first").get<double>());
  EXPECT_TRUE(stiffness.at("significant"));
  EXPECT_TRUE(named(c.at("resonances"), "resonance").at("significant"));
  for (const char* same : {"driven_inertia", "load_inertia", "damping"})
    EXPECT_FALSE(named(c.at("parameters"), same).at("significant")) << same;
  EXPECT_TRUE(c.at("model_gap").at("winding_number_condition"));
  // Of the true loops, C G scaled by the controller: 0.131 at 14.6 Hz.
  EXPECT_NEAR(c.at("model_gap").at("gap").get<double>(), 0.131,
              5.0 * c.at("model_gap").at("std").get<double>());
  // 2000 lines of so short a record hold too much noise each to tell it one by one.
  EXPECT_GT(c.at("response_distance").at("largest").get<double>(), 0.05);
  EXPECT_NE(text("c.html").find("<html"), std::string::npos);
  EXPECT_EQ(run("compare before.json after.json --require-unchanged").exit_code, 3);
}

TEST_F(Compare, SaysThatTheSameMachineIsTheSame) {
  make("before", 143.75, 1);
  make("after", 143.75, 2);
  const auto done = run("compare before.json after.json --require-unchanged --require-trusted --json -");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto c = json::parse(done.out);
  EXPECT_FALSE(c.at("changed"));
  for (const char* list : {"resonances", "parameters", "margins"})
    for (const auto& d : c.at(list)) EXPECT_FALSE(d.at("significant")) << d;
  EXPECT_TRUE(c.at("response_distance").at("weighted"));  // by the controller that the first result tells
}

TEST_F(Compare, DrawsTheLoopOfTheControllerThatEitherResultTells) {
  make("told", 143.75, 1);
  const auto silent = run("identify told.csv --delay 0.004 --json silent.json");
  ASSERT_EQ(silent.exit_code, 0) << silent.error;
  const auto drawn = [&](const std::string& arguments) {
    const auto done = run("compare " + arguments + " --report c.html");
    EXPECT_EQ(done.exit_code, 0) << done.error;
    return text("c.html").find("Nyquist curves of L = C G") != std::string::npos;
  };
  EXPECT_TRUE(drawn("told.json told.json"));
  EXPECT_TRUE(drawn("silent.json told.json"));
  EXPECT_TRUE(drawn("told.json told.json --weight 1"));
  EXPECT_FALSE(drawn("silent.json silent.json"));
}

/// Intervals of change and v-gap hold the truth; on one machine the gap is what noise makes.
TEST_F(Compare, RepeatsBothExperimentsWhereBothWereBootstrapped) {
  const std::string replicas = " --model two-mass --bootstrap 60 --jobs 2";
  make("before", 143.75, 1, replicas, 6.0);
  make("same", 143.75, 2, replicas, 6.0);
  make("after", 0.95 * 143.75, 3, replicas, 6.0);
  const auto compared = [&](const char* second) {
    const auto done = run(std::string("compare before.json ") + second +
                          " --controller pi:1.036,0.147 --json c.json --report c.html");
    EXPECT_EQ(done.exit_code, 0) << done.error;
    EXPECT_NE(done.out.find("repetitions of both experiments"), std::string::npos) << done.out;
    EXPECT_NE(text("c.html").find("Change, bootstrap"), std::string::npos);
    return json::parse(text("c.json"));
  };
  const auto changed = compared("after.json");
  const auto& gap = changed.at("model_gap").at("bootstrap");
  EXPECT_GE(gap.at("pairs").get<int>(), 55);
  EXPECT_LT(gap.at("low").get<double>(), 0.131);  // of the true loops, scaled by the controller
  EXPECT_GT(gap.at("high").get<double>(), 0.131);
  EXPECT_LT(gap.at("noise").get<double>(), gap.at("low").get<double>());
  EXPECT_LT(gap.at("probability").get<double>(), 0.02);
  const auto& stiffness = named(changed.at("parameters"), "stiffness");
  const auto& interval = stiffness.at("interval");
  EXPECT_LT(interval.at("low").get<double>(), -0.05 * 143.75);
  EXPECT_GT(interval.at("high").get<double>(), -0.05 * 143.75);
  const double width = interval.at("high").get<double>() - interval.at("low").get<double>();
  EXPECT_NEAR(width / (2.0 * 1.96 * stiffness.at("std").get<double>()), 1.0, 0.4);
  EXPECT_TRUE(named(changed.at("resonances"), "resonance").contains("interval"));
  EXPECT_TRUE(named(changed.at("margins"), "phase_margin").contains("interval"));

  const auto alike = compared("same.json");
  const auto& chance = alike.at("model_gap").at("bootstrap");
  EXPECT_GT(chance.at("probability").get<double>(), 0.02);
  EXPECT_LT(chance.at("noise").get<double>(), gap.at("low").get<double>());
}

/// A result made by hand, sound but for what a test does to it.
json small() {
  return json::parse(R"({"schema": "resonid.identification/1",
    "record": {"file": "x.csv", "samples": 100, "sample_rate_hz": 500.0, "signals": {"input": "u", "output": "y"}},
    "method": "welch", "approach": "direct",
    "units": {"input": "Nm", "velocity": "rad/s", "response": "(rad/s)/Nm"},
    "frequency_response": {"frequency_hz": [1, 2, 3], "real": [1, 1, 1], "imag": [0, 0, 0]},
    "resonances": [], "trusted": true, "findings": []})");
}

TEST_F(Compare, WhatCannotBeComparedIsAFinding) {
  const auto findings = [&](const json& a, const json& b) {
    write("a.json", a.dump());
    write("b.json", b.dump());
    const auto done = run("compare a.json b.json --json -");
    EXPECT_EQ(done.exit_code, 0) << done.error;
    const auto result = json::parse(done.out);
    std::string ids;
    for (const auto& f : result.at("findings")) ids += f.at("id").get<std::string>() + " ";
    return ids;
  };
  EXPECT_EQ(findings(small(), small()), "no-model ");
  json other = small();
  other["frequency_response"]["frequency_hz"] = {10, 20, 30};
  EXPECT_EQ(findings(small(), other), "no-common-band no-model ");
  other = small();
  other["units"]["response"] = "(rad/s)/V";
  EXPECT_EQ(findings(small(), other), "different-units ");
  EXPECT_EQ(run("compare a.json b.json --require-trusted").exit_code, 3);
  other = small();
  other["trusted"] = false;
  EXPECT_EQ(findings(other, small()), "untrusted-input no-model ");
  other = small();
  other["resonances"] = {{{"kind", "resonance"}, {"frequency_hz", 15.0}, {"source", "response"}}};
  EXPECT_EQ(findings(small(), other), "different-resonances no-model ");
}

TEST_F(Compare, RefusesNamingPathFoundAndRequired) {
  write("good.json", small().dump());
  write("broken.json", "{\"schema\": \n  oops}");
  write("other.json", R"({"schema": "resonid.track/1"})");
  json missing = small();
  missing.erase("trusted");
  missing["record"]["samples"] = "many";
  write("missing.json", missing.dump());
  expect_refused("compare good.json", {"B"});
  expect_refused("compare good.json nowhere.json", {"nowhere.json", "no such file"});
  expect_refused("compare good.json broken.json", {"broken.json", "line 2"});
  expect_refused("compare good.json other.json",
                 {"other.json", "$.schema", "\"resonid.track/1\"", "\"resonid.identification/1\""});
  expect_refused("compare missing.json good.json",
                 {"missing.json", "$.trusted: found nothing",
                  "$.record.samples: found \"many\", required a whole number"});
  write("several.json", R"({"schema": "resonid.identifications/1", "results": []})");
  expect_refused("compare good.json several.json", {"several.json", "$.joint: found nothing", "--join"});
  expect_refused("compare good.json good.json --confidence 1.5", {"--confidence", "1.5", "between 0 and 1"});
  expect_refused("compare good.json good.json --controller pi:1", {"--controller", "pi:KP,TI"});
  expect_refused("compare good.json good.json --weight 0", {"--weight", "other than 0"});
  expect_refused("compare good.json good.json --weight 2 --controller pi:1,1", {"--weight", "--controller"});
  expect_refused("compare good.json good.json --json - --report -",
                 {"--report", "--json", "standard output"});
  expect_refused("compare good.json good.json --json good.json",
                 {"--json", "good.json", "a file of its own"});
  expect_refused("compare good.json good.json --wait", {"unknown option '--wait'"});
  EXPECT_EQ(run("compare good.json good.json --json nowhere/c.json").exit_code, 1);
  EXPECT_EQ(run("compare good.json good.json --weight 2 --json c.json").exit_code, 0);
  EXPECT_TRUE(json::parse(text("c.json")).at("response_distance").at("weighted"));
}

}  // namespace
}  // namespace resonid
