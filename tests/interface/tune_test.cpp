// SPDX-License-Identifier: MIT
// `resonid tune` from the recording to the controller that is taken away, and what it refuses.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class TuneVerb : public test::ProgramTest {
 protected:
  void SetUp() override {
    ProgramTest::SetUp();
    record("run", "{kind = 'pi', gain = 1.036, integral_time_s = 0.147}", 0.004, 1);
    const auto done = run("identify run.csv --controller pi:1.036,0.147 --delay 0.004 --json result.json -q");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }

  /// System 2 under a controller: NAME.csv.
  void record(const std::string& name, const std::string& controller, double delay_s, int seed) const {
    std::ostringstream toml;
    toml << "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = 143.75, damping = 0.3}\n"
         << "controller = " << controller
         << "\nexcitation = {kind = 'prbs', register_length = 12, amplitude = 2.1}\n"
         << "measurement = {delay_s = " << delay_s << ", noise_rms = 0.1}\n"
         << "run = {sample_rate_hz = 500, duration_s = 25, seed = " << seed
         << "}\nmotion = {kind = 'constant', velocity = 10.0}\n";
    write(name + ".toml", toml.str());
    const auto done = run("simulate " + name + ".toml --out " + name + ".csv -q");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  [[nodiscard]] static std::string in_toml(const json& controller) {
    return "{kind = 'transfer-function', numerator = " + controller.at("numerator").dump() +
           ", denominator = " + controller.at("denominator").dump() + "}";
  }
  [[nodiscard]] std::string refused(const std::string& arguments) const {
    const auto done = run("tune " + arguments);
    EXPECT_EQ(done.exit_code, 2) << arguments;
    EXPECT_EQ(done.out, "") << arguments;
    return done.error;
  }
};

TEST_F(TuneVerb, NeedsNoOptionThatIdentifyWasGiven) {
  const auto done =
      run("tune result.json --json tuning.json --report tuning.html --export json:c.json "
          "--export c:c.h --export st:c.st --export hal:c.hal");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.error.find("from result.json: "), std::string::npos) << done.error;
  EXPECT_NE(done.out.find("keeps every bound"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("First step"), std::string::npos);
  EXPECT_NE(done.out.find("Trusted."), std::string::npos);
  const auto tuning = json::parse(text("tuning.json"));
  EXPECT_EQ(tuning.at("schema"), "resonid.tuning/1");
  EXPECT_TRUE(tuning.at("trusted"));
  EXPECT_FALSE(tuning.at("provenance").empty());
  const auto controller = json::parse(text("c.json"));
  for (const char* key : {"numerator", "denominator", "sample_time_s", "structure", "reference_numerator"})
    EXPECT_TRUE(controller.contains(key)) << key;
  EXPECT_NE(text("c.h").find("velocity_controller"), std::string::npos);
  EXPECT_NE(text("c.st").find("FUNCTION_BLOCK"), std::string::npos);
  EXPECT_NE(text("c.hal").find("loadrt pid"), std::string::npos);
  EXPECT_NE(text("tuning.html").find("Nyquist"), std::string::npos);
  // What was written is a controller for identify, planned or in the loop.
  const auto planned = run(
      "identify run.csv --controller pi:1.036,0.147 --delay 0.004 --planned-controller c.json --json p.json");
  ASSERT_EQ(planned.exit_code, 0) << planned.error;
  EXPECT_NE(planned.out.find("With the planned controller"), std::string::npos);
  const auto result = json::parse(text("p.json"));
  const auto& ran = result.at("loop");
  const auto& next = result.at("planned_loop");
  EXPECT_GT(next.at("crossover_hz").get<double>(), ran.at("crossover_hz").get<double>());
  EXPECT_LT(next.at("modulus_margin").get<double>(), ran.at("modulus_margin").get<double>());
}

TEST_F(TuneVerb, IsCheckedAfterwards) {
  ASSERT_EQ(run("tune result.json --structure pi --draws 500 -q --export json:c.json").exit_code, 0);
  const auto controller = in_toml(json::parse(text("c.json")));
  record("same", controller, 0.004, 2);
  auto done = run("tune result.json --evaluate c.json --draws 500 --check same.csv --json same.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_TRUE(json::parse(text("same.json")).at("check").at("agrees")) << done.out;
  record("late", controller, 0.007, 3);
  done = run("tune result.json --evaluate c.json --draws 500 --check late.csv --json late.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto check = json::parse(text("late.json")).at("check");
  EXPECT_FALSE(check.at("agrees"));
  EXPECT_NE(check.at("cause").get<std::string>().find("the delay (+"), std::string::npos)
      << check.at("cause");
  EXPECT_EQ(
      run("tune result.json --evaluate c.json --draws 500 --check late.csv --require-trusted -q").exit_code,
      3);
}

TEST_F(TuneVerb, JudgesAControllerThatIsGiven) {
  const auto done = run("tune result.json --evaluate pi:20,0.01 --draws 500 --require-trusted");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_NE(done.out.find("UNSTABLE"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("NOT trusted"), std::string::npos) << done.out;
}

TEST_F(TuneVerb, DesignsByTheResponseWhereThereIsNoModel) {
  ASSERT_EQ(run("identify run.csv --controller pi:1.036,0.147 --delay 0.004 --model none --json none.json -q")
                .exit_code,
            0);
  const auto done = run("tune none.json --json tuning.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto tuning = json::parse(text("tuning.json"));
  EXPECT_TRUE(tuning.at("by_response"));
  EXPECT_NE(done.out.find("design-by-response"), std::string::npos) << done.out;
  EXPECT_NE(refused("none.json --structure rst").find("no drive model"), std::string::npos);
  EXPECT_NE(refused("none.json --simulate run.toml").find("--simulate"), std::string::npos);
}

TEST_F(TuneVerb, RefusesInTheWordsOfTheCommandLine) {
  EXPECT_NE(refused("result.json --ms 0.9").find("--ms: found 0.9, must be > 1"), std::string::npos);
  EXPECT_NE(refused("result.json --structure fuzzy").find("--structure: found 'fuzzy'"), std::string::npos);
  EXPECT_NE(refused("result.json --export basic:x").find("--export: found 'basic:x'"), std::string::npos);
  const auto bandwidth = refused("result.json --structure pi --bandwidth 40 --draws 400");
  EXPECT_NE(bandwidth.find("--bandwidth: found 40"), std::string::npos) << bandwidth;
  EXPECT_NE(bandwidth.find("at most"), std::string::npos) << bandwidth;
  EXPECT_NE(refused("result.json --evaluate pi:1").find("--evaluate"), std::string::npos);
  EXPECT_NE(refused("run.csv").find("run.csv"), std::string::npos);
  // Nothing is written where one of the exports is refused.
  EXPECT_NE(refused("result.json --structure pi --draws 400 --export json:a.json --export klipper:a.cfg")
                .find("klipper"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path("a.json")));

  auto result = json::parse(text("result.json"));
  result["trusted"] = false;
  write("untrusted.json", result.dump());
  EXPECT_NE(refused("untrusted.json").find("--force"), std::string::npos);
  const auto forced = run("tune untrusted.json --force --structure pi --draws 400");
  ASSERT_EQ(forced.exit_code, 0) << forced.error;
  EXPECT_NE(forced.out.find("tuned-untrusted"), std::string::npos) << forced.out;
  for (auto& [name, parameter] : result["model"]["parameters"].items()) parameter["std"] = 0.0;
  result["model"].erase("covariance");
  result["trusted"] = true;
  write("exact.json", result.dump());
  EXPECT_NE(refused("exact.json").find("no covariance"), std::string::npos);
}

}  // namespace
}  // namespace resonid
