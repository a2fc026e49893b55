// SPDX-License-Identifier: MIT
// `resonid tune --first-loop`: a loop to excite a machine in before anything is identified.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "program.hpp"

namespace resonid {
namespace {

class FirstLoopVerb : public test::ProgramTest {
 protected:
  const std::string known_ =
      "tune --first-loop motor_inertia=0.032,total_inertia=0.064 --sample-rate 500 --delay 0.004 ";

  [[nodiscard]] std::string refused(const std::string& arguments) const {
    const auto done = run(arguments);
    EXPECT_EQ(done.exit_code, 2) << arguments;
    EXPECT_EQ(done.out, "");
    return done.error;
  }
};

TEST_F(FirstLoopVerb, SaysItsGainsAndWhatTheyRestOn) {
  const auto done = run(known_ +
                        "--export json:first.json --export c:first.h --export st:first.st "
                        "--export hal:first.hal --max-torque 2");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("kp 0.201 Nm/(rad/s), ki 0.105 Nm/rad"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("5 ms from torque to measured velocity"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("a machine of which no more than inertias are known"), std::string::npos)
      << done.out;
  const auto summary = [&](const std::string& known) {
    auto out = run("tune --first-loop " + known + " --sample-rate 500 --brief").out;
    for (std::size_t at; (at = out.find("\n  ")) != std::string::npos;) out.replace(at, 3, " ");
    return out;
  };
  for (const auto& [known, words] : {std::pair{"motor_inertia=0.032,total_inertia=0.064",
                                               "whose load has 1 times the motor's inertia, as"},
                                     std::pair{"motor_inertia=0.032,largest_ratio=1",
                                               "whose load has 0.1 ... 10 times the motor's inertia and"},
                                     std::pair{"motor_inertia=0.1,total_inertia=2.1",
                                               "(this one's has 20 times, which was not looked at)"}}) {
    const auto text = summary(known);
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
  ASSERT_EQ(run(known_ + "--export hal:named.hal --export-thread fast-thread").exit_code, 0);
  EXPECT_NE(text("named.hal").find(" fast-thread"), std::string::npos) << text("named.hal");
  EXPECT_NE(refused(known_ + "--export st:first.st --export-thread fast-thread").find("--export hal:FILE"),
            std::string::npos);
  for (const char* file : {"first.h", "first.st", "first.hal"})
    EXPECT_NE(text(file).find("velocity_controller"), std::string::npos) << file;
  const auto told = run(known_ + "--json -");
  ASSERT_EQ(told.exit_code, 0) << told.error;
  const auto values = nlohmann::json::parse(told.out);
  EXPECT_NEAR(values.at("kp").get<double>(), 0.064 * std::numbers::pi, 1e-12);
  EXPECT_EQ(values.at("first_loop").at("delay_s"), 0.004);
  EXPECT_EQ(values.at("sample_time_s"), 0.002);
}

/// The machine is excited in it, and what is identified takes it for the controller that ran.
TEST_F(FirstLoopVerb, IsAControllerThatASimulationRunsUnder) {
  ASSERT_EQ(run(known_ + "--json first.json").exit_code, 0);
  const auto loop = nlohmann::json::parse(text("first.json"));
  const auto list = [&](const char* name) { return loop.at(name).dump(); };
  write(
      "experiment.toml",
      "[drive]\nstructure = \"two-mass\"\ndriven_inertia = 0.032\nload_inertia = 0.032\nstiffness = 143.75\n"
      "damping = 0.3\n[controller]\nkind = \"transfer-function\"\nnumerator = " +
          list("numerator") + "\ndenominator = " + list("denominator") +
          "\n[excitation]\nkind = \"prbs\"\namplitude = 1.0\nregister_length = 9\n[measurement]\n"
          "delay_s = 0.004\nnoise_rms = 0.02\n[run]\nsample_rate_hz = 500.0\nduration_s = 6.0\n");
  ASSERT_EQ(run("simulate experiment.toml --out run.csv").exit_code, 0);
  ASSERT_EQ(run("identify run.csv --controller first.json --delay 0.004 --json result.json").exit_code, 0);
  const auto judged = run("tune result.json --evaluate first.json --draws 400 --json judged.json");
  ASSERT_EQ(judged.exit_code, 0) << judged.error;
  const auto given = nlohmann::json::parse(text("judged.json")).at("candidates").at(0);
  EXPECT_TRUE(given.at("stable").get<bool>());
}

TEST_F(FirstLoopVerb, NamesItsOptionsInErrors) {
  EXPECT_NE(refused("tune --first-loop motor_inertia=1,total_inertia=2").find("--sample-rate HZ is required"),
            std::string::npos);
  const std::string rate = " --sample-rate 500";
  EXPECT_NE(refused("tune --first-loop motor=1" + rate)
                .find("--first-loop: found 'motor', required one of motor_inertia"),
            std::string::npos);
  EXPECT_NE(refused("tune --first-loop motor_inertia" + rate).find("required NAME=VALUE"), std::string::npos);
  EXPECT_NE(refused("tune --first-loop motor_inertia=x" + rate).find("required a number"), std::string::npos);
  EXPECT_NE(
      refused("tune --first-loop motor_inertia=1" + rate).find("--first-loop: total_inertia: must be given"),
      std::string::npos);
  EXPECT_NE(refused("tune --first-loop motor_inertia=-1,total_inertia=2" + rate)
                .find("--first-loop: motor_inertia: found -1, must be > 0"),
            std::string::npos);
  EXPECT_NE(refused("tune --first-loop motor_inertia=1,total_inertia=2 --delay -1" + rate)
                .find("--delay: found -1"),
            std::string::npos);
  EXPECT_NE(refused("tune --first-loop motor_inertia=1,total_inertia=2 --sample-rate 0")
                .find("--sample-rate: found 0"),
            std::string::npos);
  EXPECT_NE(refused(known_ + "result.json").find("--first-loop: found with a RESULT"), std::string::npos);
  EXPECT_NE(refused(known_ + "--schedule 1,2").find("--schedule: found with --first-loop"),
            std::string::npos);
  for (const std::string option :
       {"--ms 1.6", "--structure pi", "--confidence 0.9", "--noise-torque 1", "--bandwidth 5",
        "--shaper-limit 0.1", "--require-trusted", "--force", "--input u", "--report x.html"}) {
    const auto error = refused(known_ + option);
    EXPECT_NE(error.find(option.substr(0, option.find(' ')) + ": found with --first-loop"), std::string::npos)
        << error;
  }
  EXPECT_NE(refused("tune --first-loop motor_inertia=0.032,total_inertia=0.064,largest_ratio=7" + rate)
                .find("--first-loop: largest_ratio: found 7, must be left out"),
            std::string::npos);
  EXPECT_NE(refused(known_ + "--export klipper:x").find("--export klipper"), std::string::npos);
  EXPECT_NE(refused("tune").find("RESULT is required, or --first-loop"), std::string::npos);
  EXPECT_NE(refused("tune result.json --delay 0.004").find("--delay: found with a RESULT"),
            std::string::npos);
}

}  // namespace
}  // namespace resonid
