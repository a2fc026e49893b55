// SPDX-License-Identifier: MIT
// `resonid tune` from the recording to the controller that is taken away, and what it refuses.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

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
  void record(const std::string& name, const std::string& controller, double delay_s, int seed,
              double amplitude = 2.1, double stiffness = 143.75) const {
    std::ostringstream drive;
    drive << "driven_inertia = 0.032, load_inertia = 0.032, stiffness = " << stiffness << ", damping = 0.3";
    record_drive(name, drive.str(), controller, seed, delay_s, amplitude);
  }
  /// Any drive.
  void record_drive(const std::string& name, const std::string& drive, const std::string& controller,
                    int seed, double delay_s = 0.004, double amplitude = 2.1) const {
    std::ostringstream toml;
    toml << "drive = {" << drive << "}\n"
         << "controller = " << controller
         << "\nexcitation = {kind = 'prbs', register_length = 12, amplitude = " << amplitude << "}\n"
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
          "--export c:c.h --export st:c.st --export hal:c.hal --export first-step:half.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  // What has no effect without --check is not said to be taken.
  EXPECT_EQ(done.error, "resonid: from result.json: controller\n");
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
  // Half of kp and a quarter of ki, to be judged and run before.
  const auto half = json::parse(text("half.json"));
  EXPECT_EQ(half.at("structure"), controller.at("structure"));
  EXPECT_LT(half.at("numerator")[0].get<double>(), 0.51 * controller.at("numerator")[0].get<double>());
  EXPECT_GT(half.at("numerator")[0].get<double>(), 0.45 * controller.at("numerator")[0].get<double>());
  const auto judged = run("tune result.json --evaluate half.json --draws 500");
  ASSERT_EQ(judged.exit_code, 0) << judged.error;
  EXPECT_NE(judged.out.find("keeps every bound"), std::string::npos) << judged.out;
  EXPECT_NE(judged.out.find("Gains: kp "), std::string::npos) << judged.out;
  EXPECT_EQ(judged.out.find("Controller of order"), std::string::npos) << judged.out;
  auto other = half;  // the same law said otherwise
  other["gains"]["kp"] = 0.9 * half.at("gains").at("kp").get<double>();
  write("other.json", other.dump());
  const auto contradicts = run("tune result.json --evaluate other.json --draws 500");
  EXPECT_NE(contradicts.exit_code, 0);
  EXPECT_NE(contradicts.error.find("other.json: \"gains\""), std::string::npos) << contradicts.error;
  for (const char* file : {"c.h", "c.st", "c.hal"}) {  // SI units too
    EXPECT_NE(text(file).find("Gains: kp "), std::string::npos) << file;
    EXPECT_NE(text(file).find("; first step kp "), std::string::npos) << file;
  }
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
  // A quarter of a sample of 2 ms turns L by 360 f 0.5 ms; the parameters tell the rest far better.
  const double by_delay = 360.0 * next.at("crossover_hz").get<double>() * 0.0005;
  EXPECT_GT(next.at("phase_margin_std_deg").get<double>(), 0.99 * by_delay);
  EXPECT_LT(next.at("phase_margin_std_deg").get<double>(), 1.2 * by_delay);
  EXPECT_LT(ran.at("phase_margin_std_deg").get<double>(), 0.5 * by_delay);
  EXPECT_NE(planned.out.find("quarter"), std::string::npos) << planned.out;
}

/// The loop of System 2 at 500 Hz with 4 ms of delay becomes unstable at a gain between 9 and 10.
TEST_F(TuneVerb, ItsPlannedLoopIsJudgedByTheLinesToo) {
  const std::string identify = "identify run.csv --controller pi:1.036,0.147 --delay 0.004 --json p.json ";
  for (const std::string model : {"", "--model none "})
    for (const char* gain : {"2", "12"}) {
      const auto done = run(identify + model + "--planned-controller pi:" + gain + ",0.1");
      ASSERT_EQ(done.exit_code, 0) << done.error;
      std::string findings;
      const auto result = json::parse(text("p.json"));
      for (const auto& f : result.at("findings")) findings += f.at("id").get<std::string>() + " ";
      const bool unstable = std::string(gain) != "2";
      EXPECT_EQ(findings.find("planned-unstable") != std::string::npos, unstable) << model << gain;
      EXPECT_EQ(done.out.find("UNSTABLE") != std::string::npos, unstable) << model << gain;
      EXPECT_EQ(findings.find("planned-not-judged"), std::string::npos) << model << gain;
      if (unstable) continue;
      const auto& loop = result.at("planned_loop");
      EXPECT_EQ(loop.at("source"), model.empty() ? "model" : "response");
      EXPECT_GT(loop.at("phase_margin_std_deg").get<double>(), 0.0);
      EXPECT_GT(loop.at("modulus_margin_std").get<double>(), 0.0);
    }
  // Of a gain that crosses below every line nothing is told.
  ASSERT_EQ(run(identify + "--model none --planned-controller pi:0.001,1000").exit_code, 0);
  EXPECT_NE(text("p.json").find("planned-not-judged"), std::string::npos);
}

/// At a gain of 8 the least phase margin is at the second crossing, and -1 lies within the error that a
/// quarter of a sample of delay makes.
TEST_F(TuneVerb, ItsPlannedLoopTellsItsLeastMargin) {
  const auto done =
      run("identify run.csv --controller pi:1.036,0.147 --delay 0.004 --planned-controller pi:8,0.05 --json "
          "p.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto result = json::parse(text("p.json"));
  EXPECT_NE(done.out.find("MAY BE UNSTABLE"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("crossings"), std::string::npos) << done.out;
  EXPECT_NE(text("p.json").find("planned-may-be-unstable"), std::string::npos);
  const auto& loop = result.at("planned_loop");
  EXPECT_GT(loop.at("phase_margin_deg").get<double>(), 60.0);
  EXPECT_LT(std::abs(loop.at("worst_phase_margin_deg").get<double>()), 20.0);
}

/// A tooth belt that resonates at 55 Hz, swept up to 48 Hz: |L| rises there, and at the resonance it is
/// above 1.
TEST_F(TuneVerb, ItsPlannedLoopIsNotJudgedByLinesThatEndBelowAResonance) {
  const auto experiment = [](const std::string& from_hz) {
    return "drive = {structure = 'tooth-belt', driven_inertia = 0.0028, cart_mass_kg = 6.7, radius_m = "
           "0.0199, "
           "specific_stiffness_n = 3.764e5, quality = 10.0, upper_length_m = 1.7, lower_length_m = 2.14, "
           "stroke_from_m = 0.38, stroke_to_m = 1.65}\n"
           "controller = {kind = 'cascade', gain = 0.12, integral_time_s = 0.2, position_gain = 5.0, "
           "velocity_feedforward = 1.0}\n"
           "motion = {kind = 'standstill', from = 1.5}\n"
           "excitation = {kind = 'chirp', amplitude = 0.5, from_hz = " +
           from_hz +
           ", to_hz = 1.5, duration_s = 18.0}\n"
           "measurement = {delay_s = 0.004, noise_rms = 0.02}\n"
           "run = {sample_rate_hz = 250.0, duration_s = 18.0, seed = 1}\n";
  };
  write("flank.toml", experiment("48.0"));
  ASSERT_EQ(run("simulate flank.toml --out flank.csv -q").exit_code, 0);
  const auto done = run("identify flank.csv --model none --planned-controller pi:0.3,0.2 --json p.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(text("p.json").find("planned-not-judged"), std::string::npos);
  const auto result = json::parse(text("p.json"));
  EXPECT_FALSE(result.at("planned_loop").contains("phase_margin_deg"));
  EXPECT_FALSE(result.at("planned_loop").contains("modulus_margin_std"));
  EXPECT_EQ(done.out.find("With the planned controller: crossover"), std::string::npos) << done.out;
  // Lines that end above it tell.
  write("above.toml", experiment("90.0"));
  ASSERT_EQ(run("simulate above.toml --out above.csv -q").exit_code, 0);
  ASSERT_EQ(run("identify above.csv --model none --planned-controller pi:0.1,0.2 --json p.json").exit_code,
            0);
  EXPECT_EQ(text("p.json").find("planned-not-judged"), std::string::npos);
}

/// What is taken away as c.json, c.h, c.st and c.hal has the gains of the design, and its comments the units
/// that are given; none of a rotary drive in Nm is left in them.
class TuneVerbUnits : public TuneVerb {
 protected:
  static constexpr double kStep_s = 0.002;

  void expect_texts(const std::string& velocity, const std::string& place, const std::string& torque) const {
    const auto tuning = json::parse(text("t.json"));
    EXPECT_EQ(tuning.at("units").at("input"), torque);
    EXPECT_EQ(tuning.at("units").at("velocity"), velocity);
    const auto& gains = tuning.at("candidates")[0].at("gains");
    const double kp = gains.at("kp"), ki = gains.at("ki");
    const auto numerator = json::parse(text("c.json")).at("numerator").get<std::vector<double>>();
    ASSERT_EQ(numerator.size(), 2U);
    EXPECT_NEAR(-numerator[1], kp, 1e-9 * kp);
    EXPECT_NEAR((numerator[0] + numerator[1]) / kStep_s, ki, 1e-9 * ki);
    EXPECT_NEAR(number_after("c.st", "gain_p : LREAL := "), kp, 1e-9 * kp);
    EXPECT_NEAR(number_after("c.st", "gain_i_step : LREAL := "), ki * kStep_s, 1e-9 * ki * kStep_s);
    EXPECT_NEAR(number_after("c.hal", ".Pgain "), kp, 1e-9 * kp);
    EXPECT_NEAR(number_after("c.hal", ".Igain "), ki, 1e-9 * ki);
    EXPECT_NEAR(number_after("c.h", "fresh = {"), kp, 1e-9 * kp);
    expect_words("c.h", "r, y in " + velocity + ", u in " + torque + "\n");
    expect_words("c.h", "torque_limit; /* " + torque + " */");
    expect_words("c.st", "reference : LREAL; (* " + velocity + " *)");
    expect_words("c.st", "torque : LREAL; (* " + torque + " *)");
    expect_words("c.st", "(* sum of ki Ts (r - y), " + torque + " *)");
    expect_words("c.hal", "velocity (" + velocity + "), the ");
    expect_words("c.hal", "(" + torque + "), and the signal that enables");
    for (const char* file : {"c.h", "c.st", "c.hal"}) {
      EXPECT_EQ(text(file).find("Nm"), std::string::npos) << file;
      if (place != "rad") {
        EXPECT_EQ(text(file).find("rad"), std::string::npos) << file;
      }
    }
  }
  void expect_words(const char* file, const std::string& words) const {
    EXPECT_NE(text(file).find(words), std::string::npos) << file << " lacks: " << words << "\n" << text(file);
  }
  [[nodiscard]] double number_after(const char* file, const std::string& words) const {
    const std::string all = text(file);
    const auto at = all.find(words);
    EXPECT_NE(at, std::string::npos) << file << " lacks: " << words;
    return at == std::string::npos ? 0.0 : std::strtod(all.c_str() + at + words.size(), nullptr);
  }
  void tune(const std::string& result) const {
    const auto done =
        run("tune " + result +
            " --structure pi --draws 500 --max-torque 200 -q --json t.json --export json:c.json "
            "--export c:c.h --export st:c.st --export hal:c.hal");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  /// A linear axis of 5 kg: axis.csv.
  void record_axis() const {
    write("axis.toml",
          "drive = {motion = 'linear', driven_inertia = 2, load_inertia = 3, stiffness = 2e4, damping = 20}\n"
          "controller = {kind = 'pi', gain = 60, integral_time_s = 0.2}\n"
          "excitation = {kind = 'prbs', register_length = 12, amplitude = 60}\n"
          "measurement = {delay_s = 0.004, noise_rms = 0.02}\n"
          "run = {sample_rate_hz = 500, duration_s = 25, seed = 1}\n"
          "motion = {kind = 'constant', velocity = 1.0}\n");
    ASSERT_EQ(run("simulate axis.toml --out axis.csv -q").exit_code, 0);
  }
};

TEST_F(TuneVerbUnits, ALinearAxisIsTakenAwayInItsUnits) {
  record_axis();
  ASSERT_EQ(run("identify axis.csv --motion linear --controller pi:60,0.2 --delay 0.004 --json axis.json -q")
                .exit_code,
            0);
  tune("axis.json");
  expect_texts("m/s", "m", "N");
  EXPECT_FALSE(json::parse(text("t.json")).contains("scale"));
  EXPECT_EQ(text("c.st").find("own units"), std::string::npos);
  const double kp = json::parse(text("t.json")).at("candidates")[0].at("gains").at("kp");

  // The same recorded in A and mm/s: 40 N/A.
  std::istringstream lines(text("axis.csv"));
  std::ostringstream own;
  std::string line, time, ru, u, y;
  std::getline(lines, line);
  ASSERT_TRUE(line.starts_with("time_s,ru,u,y,")) << line;
  own << "time_s,ru_A,u_A,y_mm_s\n";
  own.precision(12);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::getline(cells, time, ',');
    std::getline(cells, ru, ',');
    std::getline(cells, u, ',');
    std::getline(cells, y, ',');
    own << time << "," << std::stod(ru) / 40.0 << "," << std::stod(u) / 40.0 << "," << 1000.0 * std::stod(y)
        << "\n";
  }
  write("own.csv", own.str());
  ASSERT_EQ(
      run("identify own.csv --motion linear --excitation ru_A --input u_A --output y_mm_s --input-scale "
          "40 --output-scale 0.001 --input-unit N --output-unit m/s --controller pi:60,0.2 --delay 0.004 "
          "--json own.json -q")
          .exit_code,
      0);
  tune("own.json");
  expect_texts("m/s", "m", "N");
  const auto tuning = json::parse(text("t.json"));
  const auto& gains = tuning.at("candidates")[0].at("gains");
  EXPECT_NEAR(gains.at("kp").get<double>(), kp, 1e-5 * kp);
  const auto& scale = tuning.at("scale");
  const double factor = 1.0 / 40.0 / 1000.0;
  EXPECT_NEAR(scale.at("kp").get<double>(), factor * gains.at("kp").get<double>(), 1e-9);
  EXPECT_NEAR(scale.at("ki").get<double>(), factor * gains.at("ki").get<double>(), 1e-9);
  EXPECT_EQ(scale.at("kp_unit"), "A/(mm/s)");
  EXPECT_EQ(scale.at("ki_unit"), "A/mm");
  for (const char* file : {"c.h", "c.st", "c.hal"}) {
    EXPECT_NEAR(number_after(file, "In the recording's own units kp "), scale.at("kp").get<double>(),
                5e-4 * scale.at("kp").get<double>());
    EXPECT_NEAR(number_after(file, "A/(mm/s), ki "), scale.at("ki").get<double>(),
                5e-4 * scale.at("ki").get<double>());
    EXPECT_NEAR(number_after(file, "first step kp "), 0.5 * scale.at("kp").get<double>(),
                5e-4 * scale.at("kp").get<double>());
  }
}

TEST_F(TuneVerbUnits, VoltsStayVolts) {
  ASSERT_EQ(
      run("identify run.csv --input-unit V --controller pi:1.036,0.147 --delay 0.004 --json volts.json -q")
          .exit_code,
      0);
  tune("volts.json");
  expect_texts("rad/s", "rad", "V");
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
  // Less than what the first crossover would show: |S| is 1.47.
  record("later", controller, 0.0055, 3);
  done =
      run("tune result.json --evaluate c.json --draws 500 --check later.csv --json later.json "
          "--require-trusted");
  EXPECT_EQ(done.exit_code, 3) << done.error;
  EXPECT_FALSE(json::parse(text("later.json")).at("trusted"));
  EXPECT_NE(done.out.find("(measured-beyond-bound)"), std::string::npos) << done.out;
}

/// On drives that changed: every torque a quarter stronger (all masses, stiffness and damping 20 % less), a
/// softer spring, and a load of which a part turned out to hang on a spring of its own.
TEST_F(TuneVerb, ACheckNamesWhatChangedInTheDrive) {
  ASSERT_EQ(run("tune result.json --structure pi --draws 500 -q --export json:c.json").exit_code, 0);
  const auto controller = in_toml(json::parse(text("c.json")));
  struct Changed {
    const char* drive;
    std::vector<const char*> cause;
  };
  const std::vector<Changed> all = {
      {"driven_inertia = 0.0256, load_inertia = 0.0256, stiffness = 115.0, damping = 0.24",
       {"the gain: inertias and stiffness all differ by -"}},
      {"driven_inertia = 0.032, load_inertia = 0.032, stiffness = 110.0, damping = 0.3",
       {"the stiffness (-23", "%)"}},
      {"structure = 'three-mass', driven_inertia = 0.032, middle_inertia = 0.016, load_inertia = 0.016, "
       "stiffness = 200.0, damping = 0.2, stiffness_2 = 200.0, damping_2 = 0.1",
       {"another mode: the new recording shows a three-mass machine"}}};
  for (const auto& changed : all) {
    SCOPED_TRACE(changed.drive);
    record_drive("changed", changed.drive, controller, 2);
    const auto done = run("tune result.json --evaluate c.json --draws 500 --check changed.csv --json t.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    const auto tuning = json::parse(text("t.json"));
    EXPECT_FALSE(tuning.at("trusted"));
    const auto& check = tuning.at("check");
    EXPECT_FALSE(check.at("agrees"));
    EXPECT_TRUE(check.value("decided", true));
    const auto cause = check.at("cause").get<std::string>();
    for (const char* words : changed.cause) EXPECT_NE(cause.find(words), std::string::npos) << cause;
    EXPECT_NE(done.out.find("prediction-fails"), std::string::npos) << done.out;
  }
}

/// A recording of the second of two machines that one controller is for.
TEST_F(TuneVerb, IsCheckedOnWhicheverMachineWasRecorded) {
  record("stiff", "{kind = 'pi', gain = 1.036, integral_time_s = 0.147}", 0.004, 5, 2.1, 180.0);
  ASSERT_EQ(
      run("identify stiff.csv --controller pi:1.036,0.147 --delay 0.004 --json stiff.json -q").exit_code, 0);
  ASSERT_EQ(run("tune result.json stiff.json --structure pi --draws 500 -q --export json:c.json").exit_code,
            0);
  record("after", in_toml(json::parse(text("c.json"))), 0.004, 2, 2.1, 180.0);
  const auto done =
      run("tune result.json stiff.json --evaluate c.json --draws 500 --check after.csv --json check.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto tuning = json::parse(text("check.json"));
  EXPECT_TRUE(tuning.at("check").at("agrees")) << done.out;
  std::string said;
  for (const auto& finding : tuning.at("findings"))
    if (finding.at("id") == "checked-machine") said = finding.at("meaning").get<std::string>();
  EXPECT_NE(said.find("that of stiff.json explains"), std::string::npos) << said;
  EXPECT_NE(done.out.find("\nFigures and curves are those of the machine of result.json"), std::string::npos)
      << done.out;
  said.clear();
  for (const auto& finding : tuning.at("findings"))
    if (finding.at("id") == "worst-machines") said = finding.at("meaning").get<std::string>();
  EXPECT_NE(said.find("|S| is largest on the machine of "), std::string::npos) << said;
  EXPECT_EQ(said.find(".csv"), std::string::npos) << said;
}

/// Of results with other scales each by its own: the recording is one of the first, in whatever order.
TEST_F(TuneVerb, IsCheckedAsEachResultWasIdentified) {
  ASSERT_EQ(
      run("identify run.csv --controller pi:1.036,0.147 --delay 0.004 --excitation ru --json plain.json -q")
          .exit_code,
      0);
  // The same with every torque written twice as large.
  std::istringstream lines(text("run.csv"));
  std::ostringstream doubled;
  std::string line, time, ru, u;
  std::getline(lines, line);
  ASSERT_TRUE(line.starts_with("time_s,ru,u,")) << line;
  doubled << line << "\n";
  doubled.precision(12);
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::getline(cells, time, ',');
    std::getline(cells, ru, ',');
    std::getline(cells, u, ',');
    std::getline(cells, line);
    doubled << time << "," << 2.0 * std::stod(ru) << "," << 2.0 * std::stod(u) << "," << line << "\n";
  }
  write("doubled.csv", doubled.str());
  ASSERT_EQ(
      run("identify doubled.csv --controller pi:1.036,0.147 --delay 0.004 --excitation ru --input-scale 0.5 "
          "--json doubled.json -q")
          .exit_code,
      0);
  ASSERT_EQ(run("tune plain.json doubled.json --structure pi --draws 500 -q --export json:c.json").exit_code,
            0);
  record("after", in_toml(json::parse(text("c.json"))), 0.004, 2);
  const std::array orders = {"plain.json doubled.json", "doubled.json plain.json"};
  for (const std::string order : orders) {
    SCOPED_TRACE(order);
    const auto done =
        run("tune " + order + " --evaluate c.json --draws 500 --check after.csv --json check.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    const auto tuning = json::parse(text("check.json"));
    EXPECT_TRUE(tuning.at("check").at("agrees")) << done.out;
    EXPECT_NE(done.error.find("from plain.json: excitation"), std::string::npos) << done.error;
    EXPECT_NE(done.error.find("from doubled.json: excitation, input-scale"), std::string::npos) << done.error;
    std::string said;
    for (const auto& finding : tuning.at("findings"))
      if (finding.at("id") == "checked-machine") said = finding.at("meaning").get<std::string>();
    EXPECT_NE(said.find("that of plain.json explains"), std::string::npos) << said;
  }
}

/// Whose margins are others, though the machine is the same.
TEST_F(TuneVerb, ACheckFailsWhereAnotherControllerRuns) {
  for (const std::string gain : {"1.2432", "0.5"}) {  // of 1.036
    record("other", "{kind = 'pi', gain = " + gain + ", integral_time_s = 0.147}", 0.004, 2);
    const auto done =
        run("tune result.json --evaluate pi:1.036,0.147 --draws 500 --check other.csv --json other.json "
            "--require-trusted");
    EXPECT_EQ(done.exit_code, 3) << done.error;
    const auto tuning = json::parse(text("other.json"));
    EXPECT_FALSE(tuning.at("trusted"));
    const auto& check = tuning.at("check");
    EXPECT_FALSE(check.at("agrees"));
    EXPECT_TRUE(check.value("decided", true));
    const auto cause = check.at("cause").get<std::string>();
    const std::string expected = gain == "0.5" ? "gain 52 % too small" : "gain 20 % too large";
    EXPECT_NE(cause.find("another controller: " + expected), std::string::npos) << cause;
    EXPECT_NEAR(check.at("gain_change").at("value").get<double>(), std::stod(gain) / 1.036 - 1.0, 0.05);
    EXPECT_NE(done.out.find("prediction-fails"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.find("check-undecided"), std::string::npos) << done.out;
  }
  // The verdict once.
  const auto brief = run("tune result.json --evaluate pi:1.036,0.147 --draws 500 --check other.csv --brief");
  ASSERT_EQ(brief.exit_code, 0) << brief.error;
  EXPECT_TRUE(brief.out.starts_with("NOT trusted: see the findings.\n")) << brief.out;
  EXPECT_EQ(brief.out.find("Not trusted: see"), std::string::npos) << brief.out;
}

/// How the recording of --check is identified: as the result was.
TEST_F(TuneVerb, IsCheckedInTheWayThatTheResultWasIdentified) {
  ASSERT_EQ(run("identify run.csv --controller pi:1.036,0.147 --delay 0.004 --method local-polynomial "
                "--model two-mass "
                "--friction viscous --torque-lag 0 --excitation ru --json told.json -q")
                .exit_code,
            0);
  ASSERT_EQ(run("tune told.json --structure pi --draws 500 -q --export json:c.json").exit_code, 0);
  record("after", in_toml(json::parse(text("c.json"))), 0.004, 2);
  const std::string tune = "tune told.json --evaluate c.json --draws 500 --json - --check ";
  const auto inherited = run(tune + "after.csv");
  ASSERT_EQ(inherited.exit_code, 0) << inherited.error;
  for (const char* name : {"method", "model", "friction", "torque-lag", "excitation", "controller"})
    EXPECT_NE(inherited.error.find(name), std::string::npos) << name << ": " << inherited.error;
  EXPECT_EQ(inherited.error.find("delay"), std::string::npos) << inherited.error;
  const auto told =
      run(tune +
          "after.csv --method local-polynomial --model two-mass --friction viscous --torque-lag 0 "
          "--excitation ru");
  ASSERT_EQ(told.exit_code, 0) << told.error;
  EXPECT_EQ(json::parse(inherited.out).at("check"), json::parse(told.out).at("check"));
  // What is given overrules it, and makes a difference.
  const auto other = run(tune + "after.csv --method periodic");
  ASSERT_EQ(other.exit_code, 0) << other.error;
  EXPECT_NE(json::parse(other.out).at("check").at("measured"),
            json::parse(inherited.out).at("check").at("measured"));
  // A column of another name is found, as if none had been named.
  auto renamed = text("after.csv");
  const auto at = renamed.find("ru");
  ASSERT_LT(at, renamed.find('\n'));
  renamed.replace(at, 2, "excitation");
  write("renamed.csv", renamed);
  const auto found = run(tune + "renamed.csv");
  ASSERT_EQ(found.exit_code, 0) << found.error;
  EXPECT_EQ(json::parse(found.out).at("check").at("measured"),
            json::parse(inherited.out).at("check").at("measured"));
  EXPECT_EQ(run(tune + "renamed.csv --excitation ru").exit_code, 2);
}

/// What `tune --export json` writes is judged by `tune --evaluate` as it was designed.
TEST_F(TuneVerb, JudgesWhatItExported) {
  for (const std::string structure : {"pi", "p", "pi+biquads", "pid", "cascade"}) {
    SCOPED_TRACE(structure);
    const std::string file = structure + ".json";
    auto done = run("tune result.json --draws 500 --structure " + structure +
                    " --json t.json -q --export json:" + file);
    ASSERT_EQ(done.exit_code, 0) << done.error;
    EXPECT_EQ(json::parse(text(file)).contains("position_gain"), structure == "cascade");
    const auto designed = json::parse(text("t.json")).at("candidates").at(0);
    const std::array files = {file, std::string("t.json")};  // the design itself is such a file too
    for (const auto& given : files) {
      done = run("tune result.json --draws 500 --json - --evaluate " + given);
      ASSERT_EQ(done.exit_code, 0) << done.error;
      const auto judged = json::parse(done.out).at("candidates").at(0);
      EXPECT_EQ(judged.at("name"), designed.at("name"));
      const auto &was = designed.at("figures"), &is = judged.at("figures");
      ASSERT_EQ(is.size(), was.size());
      // By the same bounds, but for |C S|, which a search limits for its filters.
      if (structure == "pi" || structure == "p" || structure == "cascade") {
        EXPECT_EQ(judged.at("posterior"), designed.at("posterior"));
      }
      for (std::size_t i = 0; i < was.size(); ++i) {
        EXPECT_EQ(is[i].at("name"), was[i].at("name"));
        const double value = was[i].value("value", 0.0);
        EXPECT_NEAR(is[i].value("value", 0.0), value, 1e-4 * std::abs(value) + 1e-6) << was[i].at("name");
      }
    }
  }
  // As the controller that ran, beside which another one is designed.
  const auto beside = run("tune result.json --draws 500 --structure pi --controller cascade.json --json -");
  ASSERT_EQ(beside.exit_code, 0) << beside.error;
  const auto running = json::parse(beside.out).at("running");
  EXPECT_EQ(running.at("position_gain"), json::parse(text("cascade.json")).at("position_gain"));
  // An older file of a cascade does not tell its gain.
  auto older = json::parse(text("cascade.json"));
  older.erase("position_gain");
  write("older.json", older.dump());
  EXPECT_NE(refused("result.json --evaluate older.json").find("position_gain"), std::string::npos);
}

/// Velocity and torque of a position loop: the controller between them is C (1 + kv q).
TEST_F(TuneVerb, APositionLoopIsIdentifiedAndChecked) {
  ASSERT_EQ(
      run("tune result.json --structure cascade --draws 500 --json t.json -q --export json:c.json").exit_code,
      0);
  const auto c = json::parse(text("t.json")).at("candidates").at(0);
  const double kp = c.at("gains").at("kp"), ki = c.at("gains").at("ki"), kv = c.at("position_gain");
  std::ostringstream controller;
  controller.precision(17);
  controller << "{kind = 'cascade', gain = " << kp << ", integral_time_s = " << kp / ki
             << ", position_gain = " << kv << ", velocity_feedforward = 1.0}";
  record("moved", controller.str(), 0.004, 4);
  auto done = run("identify moved.csv --controller c.json --delay 0.004 --json moved.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto result = json::parse(text("moved.json"));
  EXPECT_TRUE(result.at("trusted"));
  EXPECT_EQ(done.out.find("controller-differs"), std::string::npos) << done.out;
  const auto figure = [&](const char* name) {
    for (const auto& f : c.at("figures"))
      if (f.at("name") == name) return f.at("value").get<double>();
    return std::nan("");
  };
  EXPECT_NEAR(result.at("loop").at("crossover_hz").get<double>(), figure("crossover_hz"),
              0.03 * figure("crossover_hz"));
  EXPECT_NEAR(1.0 / result.at("loop").at("modulus_margin").get<double>(), figure("sensitivity_peak"), 0.03);
  done = run("tune result.json --evaluate c.json --draws 500 --check moved.csv --json check.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_TRUE(json::parse(text("check.json")).at("check").at("agrees")) << done.out;
  // The result keeps the position gain for whoever reads it.
  done = run("tune moved.json --structure pi --draws 500 --json -");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NEAR(json::parse(done.out).at("running").at("position_gain").get<double>(), kv, 1e-9);
}

TEST_F(TuneVerb, AWeakExcitationDecidesNothing) {
  ASSERT_EQ(run("tune result.json --structure pi --draws 500 -q --export json:c.json").exit_code, 0);
  record("weak", in_toml(json::parse(text("c.json"))), 0.004, 2, 0.1);
  const auto done = run("tune result.json --evaluate c.json --draws 500 --check weak.csv --json weak.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto check = json::parse(text("weak.json")).at("check");
  EXPECT_FALSE(check.at("agrees"));
  EXPECT_EQ(check.value("decided", true), false) << done.out;
  EXPECT_NE(done.out.find("it cannot be told"), std::string::npos) << done.out;
  // The design stays what it is, and whoever requires trust of the machine has none.
  EXPECT_TRUE(json::parse(text("weak.json")).at("trusted"));
  EXPECT_EQ(
      run("tune result.json --evaluate c.json --draws 500 --check weak.csv --require-trusted -q").exit_code,
      3);
}

TEST_F(TuneVerb, JudgesAControllerThatIsGiven) {
  const auto done = run("tune result.json --evaluate pi:20,0.01 --draws 500 --require-trusted");
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_NE(done.out.find("UNSTABLE"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("NOT trusted: the loop is UNSTABLE.\n"), std::string::npos) << done.out;
}

/// An unstable loop is no more simulated than one whose controller is unstable by itself.
TEST_F(TuneVerb, GivesEveryUnstableLoopOneVerdict) {
  write("grows.json", R"({"numerator": [2, -1.9], "denominator": [1, -1.2]})");
  write("reversed.json", R"({"numerator": [-2, 1.9], "denominator": [1, -1]})");
  for (const std::string given : {"pi:20,0.1", "grows.json", "reversed.json"}) {
    const auto done = run("tune result.json --draws 500 --evaluate " + given);
    ASSERT_EQ(done.exit_code, 0) << done.error;
    EXPECT_NE(done.out.find("NOT trusted: the loop is UNSTABLE.\n"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.find("see the findings"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.find("common rule"), std::string::npos) << done.out;
    EXPECT_EQ(done.out.find("controller.r"), std::string::npos) << done.out;
  }
  write("nothing.json", R"({"numerator": [0], "denominator": [1]})");
  EXPECT_NE(refused("result.json --evaluate nothing.json").find("--evaluate: must have a gain"),
            std::string::npos);
  EXPECT_NE(refused("result.json --draws 500 --evaluate grows.json --simulate run.toml")
                .find("--simulate: found a controller that is unstable by itself, with a pole at |z| = 1.2"),
            std::string::npos);
}

TEST_F(TuneVerb, TellsEveryCrossingOfALoopThatHasSeveral) {
  const auto one = run("tune result.json --evaluate pi:0.9,0.3");
  ASSERT_EQ(one.exit_code, 0) << one.error;
  EXPECT_EQ(one.out.find("Crossings of |L| = 1"), std::string::npos) << one.out;
  EXPECT_NE(one.out.find("at, Hz"), std::string::npos) << one.out;
  const auto done = run("tune result.json --evaluate pi:4,0.3 --json tuning.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("Crossings of |L| = 1"), std::string::npos) << done.out;
  const auto crossings = json::parse(text("tuning.json")).at("candidates").at(0).at("crossings");
  ASSERT_EQ(crossings.size(), 3U);
  for (const auto& crossing : crossings) {
    EXPECT_LT(crossing.at("frequency_low_hz"), crossing.at("frequency_high_hz")) << crossing;
    EXPECT_LT(crossing.at("phase_margin_low_deg"), crossing.at("phase_margin_high_deg")) << crossing;
    EXPECT_LT(std::abs(crossing.at("phase_margin_worst_deg").get<double>()),
              std::abs(crossing.at("phase_margin_deg").get<double>()))
        << crossing;
  }
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
  // Margins on the lines, with the worst over the error bars.
  EXPECT_NE(done.out.find("phase margin"), std::string::npos) << done.out;
  EXPECT_FALSE(tuning.at("candidates").at(0).at("crossings").empty());
  // Any controller of velocity is judged by them.
  write("p.json", R"({"numerator": [1.0], "denominator": [1.0], "sample_time_s": 0.002})");
  write("lag.json", R"({"numerator": [0.5], "denominator": [1.0, -0.5], "sample_time_s": 0.002})");
  for (const char* file : {"p.json", "lag.json"}) {
    const auto judged = run(std::string("tune none.json --json judged.json --evaluate ") + file);
    ASSERT_EQ(judged.exit_code, 0) << judged.error;
    EXPECT_TRUE(json::parse(text("judged.json")).at("candidates").at(0).at("stable")) << judged.out;
  }
  const auto given = run("tune none.json --evaluate pi:20,0.1 --require-trusted");
  EXPECT_EQ(given.exit_code, 3);
  EXPECT_NE(given.out.find("design-unstable"), std::string::npos) << given.out;
  EXPECT_NE(given.out.find("by the measured response its loop is UNSTABLE"), std::string::npos) << given.out;
  EXPECT_EQ(given.out.find("identified machine"), std::string::npos) << given.out;
  EXPECT_NE(refused("none.json --structure rst").find("no drive model"), std::string::npos);
  EXPECT_NE(refused("none.json --simulate run.toml").find("--simulate"), std::string::npos);
  for (const std::string option : {"--overshoot 0.1", "--step 2", "--biquads 2", "--draws 500", "--seed 2"}) {
    const auto error = refused("none.json " + option);
    EXPECT_NE(
        error.find(option.substr(0, option.find(' ')) + ": found with a RESULT that holds no drive model"),
        std::string::npos)
        << error;
  }
}

/// An option that would change nothing is refused by name, with what it goes.
TEST_F(TuneVerb, RefusesOptionsThatWouldBeIgnored) {
  for (const std::string option : {"--input u", "--output y", "--input-scale 2", "--output-scale -1",
                                   "--decimal point", "--lines 1,2", "--method periodic", "--model rigid",
                                   "--friction none", "--radius 0.1", "--lambda 0.1", "--from 1"}) {
    const auto error = refused("result.json " + option);
    EXPECT_NE(error.find(option.substr(0, option.find(' ')) + ": found with no --check"), std::string::npos)
        << error;
    EXPECT_NE(error.find("required --check RECORD"), std::string::npos) << error;
  }
  for (const std::string option : {"--structure pi", "--biquads 2", "--overshoot 0.1"}) {
    const auto error = refused("result.json --evaluate pi:1,0.1 " + option);
    EXPECT_NE(error.find(option.substr(0, option.find(' ')) + ": found with --evaluate"), std::string::npos)
        << error;
  }
  EXPECT_NE(refused("result.json --shaper-limit 0.1").find("--shaper-limit: found with no --shaper"),
            std::string::npos);
  EXPECT_NE(refused("result.json --export-name x").find("required --export"), std::string::npos);
  EXPECT_NE(refused("result.json --export c:a.h --export-thread x").find("--export-thread: found with no"),
            std::string::npos);
  EXPECT_NE(refused("result.json --export-axis y").find("required --export klipper:FILE"), std::string::npos);
  EXPECT_NE(refused("result.json --structure p --overshoot 0.1").find("--overshoot: found with a P"),
            std::string::npos);
  EXPECT_NE(refused("result.json --structure cascade --overshoot 0.1")
                .find("--overshoot: found with a position loop"),
            std::string::npos);
  EXPECT_NE(
      refused("result.json --evaluate pi:1,0.1 --position-peak 1.1").find("--position-peak: found with no"),
      std::string::npos);
  EXPECT_NE(
      refused("result.json --evaluate pi:1,0.1 --delay 0.004 --check run.csv").find("--delay: found with"),
      std::string::npos);
  // A profile is for other calls, too.
  write("resonid.toml", "input = 'u'\nmethod = 'periodic'\n");
  const auto done = run("tune result.json --structure pi --draws 400");
  EXPECT_EQ(done.exit_code, 0) << done.error;
}

TEST_F(TuneVerb, RefusesInTheWordsOfTheCommandLine) {
  EXPECT_NE(refused("result.json --ms 0.9").find("--ms: found 0.9, must be > 1"), std::string::npos);
  EXPECT_NE(refused("result.json --structure fuzzy").find("--structure: found 'fuzzy'"), std::string::npos);
  EXPECT_NE(refused("result.json --export basic:x").find("--export: found 'basic:x'"), std::string::npos);
  const auto bandwidth = refused("result.json --structure pi --bandwidth 40 --draws 400");
  EXPECT_NE(bandwidth.find("--bandwidth: found 40"), std::string::npos) << bandwidth;
  EXPECT_NE(bandwidth.find("at most"), std::string::npos) << bandwidth;
  EXPECT_NE(refused("result.json --evaluate pi:1").find("--evaluate"), std::string::npos);
  // Whatever else is wrong with the export.
  EXPECT_NE(refused("result.json --export klipper:a.cfg --export-axis q").find("--export-axis: found 'q'"),
            std::string::npos);
  write("again.csv", text("run.csv"));
  ASSERT_EQ(run("identify run.csv again.csv --controller pi:1.036,0.147 --delay 0.004 --json both.json -q")
                .exit_code,
            0);
  const auto batch = refused("both.json");
  EXPECT_NE(batch.find("both.json: holds a result for each of run.csv, again.csv, required one"),
            std::string::npos)
      << batch;
  EXPECT_NE(batch.find("--join"), std::string::npos) << batch;
  EXPECT_NE(refused("result.json --structure cascade --load-peak 1.5").find("--position-peak"),
            std::string::npos);
  EXPECT_NE(refused("result.json --position-peak 1.2").find("--structure cascade"), std::string::npos);
  EXPECT_NE(refused("run.csv").find("run.csv"), std::string::npos);
  EXPECT_NE(refused("result.json --structure pi --biquads 3").find("--biquads"), std::string::npos);
  // Before anything is designed: its first stage would be refused, too.
  const auto pid =
      refused("result.json --structure pid --bandwidth 1000 --export json:a.json --export hal:a.hal");
  EXPECT_NE(pid.find("c, st and json take every structure"), std::string::npos) << pid;
  EXPECT_NE(refused("result.json --bandwidth 1000 --simulate nosuch").find("nosuch"), std::string::npos);
  // Nothing is written where one of the exports is refused.
  EXPECT_NE(refused("result.json --structure pi --draws 400 --export json:a.json --export klipper:a.cfg")
                .find("klipper"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(path("a.json")));
  EXPECT_NE(refused("result.json --structure pi --draws 400 --export-thread 'two words' --export hal:a.hal")
                .find("name of a thread"),
            std::string::npos);

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
