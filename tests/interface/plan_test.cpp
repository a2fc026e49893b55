// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <resonid/io/detail/table.hpp>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class PlanVerb : public test::ProgramTest {
 protected:
  const std::string drive_ =
      "plan --parameters driven_inertia=0.032,load_inertia=0.032,stiffness=143.75,damping=0.3 --noise 0.1 "
      "--sample-rate 500 --controller pi:1.036,0.147 --delay 0.004 --spread 0 --period 1 ";
};

TEST_F(PlanVerb, WritesExcitationRehearsalPlanAndPage) {
  const auto done = run(drive_ +
                        "--type multisine --max-torque 1 --accuracy resonance=0.3%,phase_margin=0.2 "
                        "--out ru.csv --experiment e.toml --json plan.json --report plan.html");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("All targets met by a multisine"), std::string::npos) << done.out;
  EXPECT_NE(text("plan.html").find("Predicted error bars"), std::string::npos);
  const auto plan = json::parse(text("plan.json"));
  EXPECT_EQ(plan.at("schema"), "resonid.plan/1");
  EXPECT_TRUE(plan.at("reached"));
  EXPECT_EQ(plan.at("wishes").size(), 2U);
  EXPECT_EQ(plan.at("alternatives").size(), 2U);
  EXPECT_LE(plan.at("extremes").at("torque").get<double>(), 1.0 + 1e-9);
  const auto csv = io::read_csv(path("ru.csv"));
  ASSERT_TRUE(csv.has_value());
  EXPECT_EQ(csv->names, (std::vector<std::string>{"time_s", "ru"}));
  EXPECT_EQ(csv->columns[0].size(), plan.at("samples").get<std::size_t>());

  // The rehearsal injects the same samples, and what identify finds has the error bars that were foretold.
  ASSERT_EQ(run("simulate e.toml --out record.csv").exit_code, 0);
  const auto record = io::read_csv(path("record.csv"));
  ASSERT_TRUE(record.has_value());
  ASSERT_EQ(record->columns[1].size(), csv->columns[1].size());
  for (std::size_t k = 0; k < csv->columns[1].size(); ++k)
    ASSERT_NEAR(record->columns[1][k], csv->columns[1][k], 1e-8);
  const auto found =
      run("identify record.csv --model two-mass --lines 2:34:1 --controller pi:1.036,0.147 --delay 0.004 "
          "--json result.json");
  ASSERT_EQ(found.exit_code, 0) << found.error;
  const auto result = json::parse(text("result.json"));
  for (const auto& figure : plan.at("figures")) {
    if (figure.at("name") != "stiffness") continue;
    const double told = figure.at("std").get<double>();
    const auto& stiffness = result.at("model").at("parameters").at("stiffness");
    EXPECT_NEAR(stiffness.at("std").get<double>() / told, 1.0, 0.15);
    EXPECT_NEAR(stiffness.at("value").get<double>(), 143.75, 4.0 * told);
  }
  // The result is the next plan's nominal model.
  const auto next =
      run("plan --model result.json --controller pi:1.036,0.147 --max-torque 1 "
          "--spread 0 --period 1 --type chirp --accuracy resonance=0.5% --json -");
  ASSERT_EQ(next.exit_code, 0) << next.error;
  const auto second = json::parse(next.out);
  EXPECT_EQ(second.at("type"), "chirp");
  EXPECT_EQ(second.at("model").at("delay_s"), 0.004);
  EXPECT_NEAR(second.at("model").at("noise_rms").get<double>(), 0.1, 0.01);
}

TEST_F(PlanVerb, TakesOneAccuracyForAllParameters) {
  const auto done = run(drive_ + "--type chirp --max-torque 1 --accuracy 2% --json plan.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto wishes = json::parse(text("plan.json")).at("wishes");
  ASSERT_EQ(wishes.size(), 4U);
  const double values[] = {0.032, 0.032, 143.75, 0.3};
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_NEAR(wishes[i].at("wanted_std").get<double>(), 0.02 * values[i], 1e-6 * values[i]);
}

TEST_F(PlanVerb, PlansThreeMassesFromParametersAndFromAResult) {
  const auto done = run(
      "plan --parameters driven_inertia=0.02,middle_inertia=0.01,load_inertia=0.03,stiffness=200,damping=0.2,"
      "stiffness_2=500,damping_2=0.3 --noise 0.05 --sample-rate 1000 --delay 0.001 --controller "
      "pi:1.036,0.147 "
      "--max-torque 1 --spread 0 --period 0.5 --band 4:90 --type multisine --max-time 20 "
      "--accuracy resonance_2_hz=0.3%,resonance_damping_ratio=2%,stiffness_2=3% --experiment e.toml --json "
      "p.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto plan = json::parse(text("p.json"));
  EXPECT_EQ(plan.at("model").at("structure"), "three-mass");
  EXPECT_EQ(plan.at("wishes").at(0).at("figure"), "resonance_2");
  EXPECT_EQ(plan.at("wishes").at(1).at("figure"), "resonance_damping");
  ASSERT_EQ(run("simulate e.toml --out record.csv").exit_code, 0);
  const auto found =
      run("identify record.csv --model three-mass --lines 4:90:2 --controller pi:1.036,0.147 --delay 0.001 "
          "--json result.json");
  ASSERT_EQ(found.exit_code, 0) << found.error;
  const auto result = json::parse(text("result.json"));
  for (const auto& figure : plan.at("figures")) {
    if (figure.at("name") != "stiffness_2") continue;
    const auto& stiffness = result.at("model").at("parameters").at("stiffness_2");
    EXPECT_NEAR(stiffness.at("std").get<double>() / figure.at("std").get<double>(), 1.0, 0.2);
    EXPECT_NEAR(stiffness.at("value").get<double>(), 500.0, 4.0 * figure.at("std").get<double>());
  }
  const auto next =
      run("plan --model result.json --controller pi:1.036,0.147 --max-torque 1 --spread 0 --period 0.5 "
          "--type chirp --max-time 10 --accuracy antiresonance_2=5% --json -");
  ASSERT_EQ(next.exit_code, 0) << next.error;
  EXPECT_EQ(json::parse(next.out).at("model").at("structure"), "three-mass");
}

TEST_F(PlanVerb, SaysWhyAPrbsIsLeftOut) {
  const auto done = run(drive_ + "--max-torque 1 --band 5:30 --accuracy stiffness=1% --json plan.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("No PRBS was laid out"), std::string::npos) << done.out;
  const auto plan = json::parse(text("plan.json"));
  ASSERT_EQ(plan.at("left_out").size(), 1U);
  EXPECT_EQ(plan.at("left_out").at(0).at("type"), "prbs");
  EXPECT_EQ(plan.at("alternatives").size(), 1U);
  expect_refused(drive_ + "--max-torque 1 --band 5:30 --type prbs", {"--band", "PRBS"});
}

TEST_F(PlanVerb, SaysWhatCannotBeReached) {
  const auto done = run(drive_ + "--type multisine --max-torque 0.2 --max-time 4 --accuracy damping=0.1%");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("cannot be met within the limits"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("torque"), std::string::npos) << done.out;
}

TEST_F(PlanVerb, RefusesNamingWhatWasFoundAndIsRequired) {
  write("broken.json", "[1,");
  write("other.json", R"({"schema": "resonid.track/1"})");
  expect_refused("plan --noise 1 --max-torque 1", {"--model or --parameters is required"});
  expect_refused("plan --model absent.json --max-torque 1", {"absent.json", "no such file"});
  expect_refused("plan --model broken.json --max-torque 1", {"broken.json", "line 1"});
  expect_refused("plan --model other.json --max-torque 1", {"other.json", "$.schema"});
  expect_refused("plan --parameters stifness=1", {"--parameters", "stifness", "did you mean 'stiffness'"});
  expect_refused("plan --parameters stiffness=1", {"--parameters", "driven_inertia is required"});
  expect_refused("plan --parameters stiffness", {"--parameters", "NAME=VALUE"});
  expect_refused("plan --parameters driven_inertia=x", {"--parameters", "'x'", "a number"});
  expect_refused("plan --parameters driven_inertia=1 --max-torque 1", {"--sample-rate is required"});
  expect_refused("plan --parameters driven_inertia=1 --sample-rate 500", {"--noise is required"});
  expect_refused("plan --parameters driven_inertia=-1 --sample-rate 500 --noise 1 --max-torque 1",
                 {"driven_inertia", "-1", "must be > 0"});
  expect_refused(drive_, {"--max-torque is required"});
  expect_refused(drive_ + "--max-torque -1", {"--max-torque", "-1", "must be > 0"});
  expect_refused(drive_ + "--max-torque 1 --max-time 0.01", {"--max-time", "0.01"});
  expect_refused(drive_ + "--max-torque 1 --max-time 5000", {"--max-time", "5000", "2 000 000 samples"});
  expect_refused(drive_ + "--max-torque 1 --accuracy 0%", {"--accuracy", "'0%'", "NAME=VALUE"});
  expect_refused(drive_ + "--max-torque 1 --accuracy resonanse=1%",
                 {"--accuracy", "did you mean 'resonance'"});
  expect_refused(drive_ + "--max-torque 1 --accuracy resonance=0%", {"--accuracy", "'0%'", "> 0"});
  expect_refused(drive_ + "--max-torque 1 --accuracy resonance_2=1%",
                 {"--accuracy", "resonance_2", "a two-mass drive"});
  expect_refused(drive_ + "--max-torque 0", {"--max-torque", "must be > 0"});
  expect_refused(drive_ + "--max-torque 1 --max-stroke -1", {"--max-stroke", "-1", "must be > 0"});
  expect_refused(drive_ + "--max-torque 1 --max-velocity 0", {"--max-velocity", "must be > 0"});
  expect_refused(drive_ + "--max-torque 1 --band 5:400", {"--band", "400", "half the sample rate"});
  expect_refused(
      "plan --parameters driven_inertia=1,stiffness_2=3 --sample-rate 500 --noise 1 --max-torque 1",
      {"--parameters", "load_inertia is required", "three-mass"});
  expect_refused(drive_ + "--max-torque 1 --type sweep", {"--type", "sweep"});
  expect_refused(
      "plan --parameters driven_inertia=1 --sample-rate 500 --noise 1 --max-torque 1 --controller "
      "pi:5000,0.1",
      {"--controller", "unstable"});
  expect_refused(drive_ + "--max-torque 1 --json - --out -", {"--json", "--out"});
}

TEST_F(PlanVerb, ExciteOptimisesPhases) {
  const auto done =
      run("excite multisine --sample-rate 2000 --lines 20:120:5 --phases optimised --json - --out e.csv");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_LT(json::parse(done.out).at("crest_factor").get<double>(), 1.43);
  expect_refused("excite multisine --sample-rate 2000 --lines 20,28.284271247,40 --phases optimised",
                 {"--lines", "common period"});
  expect_refused("excite multisine --sample-rate 2000 --lines 20,40 --phases given", {"--phase"});
}

}  // namespace
}  // namespace resonid
