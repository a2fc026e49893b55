// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class Validate : public test::ProgramTest {
 protected:
  void simulate(const std::string& name, double stiffness, int seed, double noise = 0.1) const {
    std::ostringstream toml;
    toml << "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = " << stiffness
         << ", damping = 0.3}\ncontroller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
         << "excitation = {kind = 'prbs', register_length = 13, amplitude = 2.1}\n"
         << "measurement = {delay_s = 0.004, noise_rms = " << noise << "}\n"
         << "run = {sample_rate_hz = 500, duration_s = 16, seed = " << seed
         << "}\nmotion = {kind = 'constant', velocity = 10.0}\n";
    write(name + ".toml", toml.str());
    const auto done =
        run("simulate " + name + ".toml --out " + name + ".csv --truth " + name + "_truth.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  void identify(const std::string& name) const {
    const auto done = run("identify " + name + ".csv --controller pi:1.036,0.147 --delay 0.004 --json " +
                          name + ".json --excitation-type other");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  [[nodiscard]] json validated(const std::string& arguments) const {
    const auto done = run("validate " + arguments + " --controller pi:1.036,0.147 --json -");
    EXPECT_EQ(done.exit_code, 0) << done.error;
    return json::parse(done.out, nullptr, false);
  }

  std::vector<std::string> names_;
};

TEST_F(Validate, AcceptsTheModelOfTheSameDrive) {
  simulate("fitted", 143.75, 1);
  identify("fitted");
  simulate("other", 143.75, 2);
  for (const char* approach : {"", " --approach indirect"}) {
    const auto v = validated(std::string("fitted.json other.csv") + approach);
    EXPECT_EQ(v.at("schema"), "resonid.validation/1");
    EXPECT_EQ(v.at("verdict"), "accepted") << v.at("findings");
    EXPECT_TRUE(v.at("trusted"));
    const auto& r = v.at("residual");
    // What is left is the noise of the record.
    EXPECT_NEAR(r.at("rms").get<double>(), 0.1, 0.006);
    EXPECT_EQ(r.at("judged_lags"), 5);  // 3 poles, 2 samples of delay
    EXPECT_EQ(r.at("lags").size(), 51U);
    EXPECT_EQ(r.at("simulated").at("correlation").size(), 51U);
    EXPECT_LT(r.at("simulated").at("largest").get<double>(), 1.5 * r.at("limit").get<double>());
    EXPECT_NEAR(v.at("simulation_fit_percent").get<double>(), v.at("prediction_fit_percent").get<double>(),
                1.0);
    EXPECT_GT(v.at("response").at("probability").get<double>(), 1e-4);
  }
}

TEST_F(Validate, TellsAnotherDrive) {
  simulate("fitted", 143.75, 1);
  identify("fitted");
  simulate("softer", 0.9 * 143.75, 3);
  const auto doubtful = validated("fitted.json softer.csv");
  EXPECT_EQ(doubtful.at("verdict"), "doubtful");
  EXPECT_TRUE(doubtful.at("trusted"));
  EXPECT_NEAR(doubtful.at("response").at("worst_line_hz").get<double>(), 15.0, 2.0);
  simulate("another", 0.5 * 143.75, 4);
  const auto rejected = validated("fitted.json another.csv");
  EXPECT_EQ(rejected.at("verdict"), "rejected");
  EXPECT_FALSE(rejected.at("trusted"));
  EXPECT_GT(rejected.at("residual").at("simulated").at("largest").get<double>(), 0.15);
  EXPECT_EQ(run("validate fitted.json another.csv --require-trusted").exit_code, 3);
}

TEST_F(Validate, HighSignalToNoiseFailsThePerLagLimitAndRejectsNothing) {
  simulate("fitted", 143.75, 1);
  identify("fitted");
  simulate("quiet", 1.01 * 143.75, 5, 0.001);
  const auto v = validated("fitted.json quiet.csv");
  const auto& r = v.at("residual");
  EXPECT_GT(r.at("simulated").at("largest").get<double>(), r.at("limit").get<double>());
  EXPECT_GT(r.at("snr_db").get<double>(), 25.0);
  EXPECT_NE(v.at("verdict"), "rejected");
  EXPECT_TRUE(v.at("trusted"));
}

TEST_F(Validate, TakesABareTransferFunction) {
  simulate("fitted", 143.75, 1);
  simulate("other", 143.75, 2);
  const auto truth = json::parse(text("fitted_truth.json"));
  write("tf.json", truth.at("model").at("transfer_function").dump());
  for (const char* approach : {"", " --approach indirect"}) {
    const auto v = validated(std::string("tf.json other.csv --delay 0.004") + approach);
    EXPECT_EQ(v.at("verdict"), "accepted") << v.at("findings");
    EXPECT_NEAR(v.at("residual").at("rms").get<double>(), 0.1, 0.006);
    EXPECT_EQ(v.at("residual").at("judged_lags"), 5);
  }
}

TEST_F(Validate, AgreesWithIdentifyAboutOneRecording) {
  // A sweep whose last lines look better known than they are; motion alone; one that identify does not trust.
  for (const auto& [name, experiment, told] :
       std::vector<std::array<std::string, 3>>{{"sweep", "vi_chirp_a_5s", "--delay 0.004"},
                                               {"moved", "axis_s_curve_gravity", ""},
                                               {"changed", "belt_loosens", "--delay 0.004"}}) {
    ASSERT_EQ(run("simulate " + experiment + " --out " + name + ".csv").exit_code, 0);
    ASSERT_EQ(run("identify " + name + ".csv --json " + name + ".json " + told).exit_code, 0);
    const auto done = run("validate " + name + ".json " + name + ".csv --json -");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    const auto v = json::parse(done.out);
    const bool trusted = json::parse(text(name + ".json")).at("trusted");
    EXPECT_EQ(trusted, name != "changed");
    EXPECT_TRUE(v.at("own_record")) << name;
    EXPECT_EQ(v.at("trusted"), trusted) << name << v.at("findings");
    EXPECT_EQ(v.at("verdict"), trusted ? "accepted" : "doubtful") << name << v.at("findings");
  }
}

/// One file cut in two is two recordings. They excite two bands here, which is said.
TEST_F(Validate, TakesTheOtherHalfOfAFileForAnotherRecording) {
  ASSERT_EQ(run("simulate demo --out halves.csv").exit_code, 0);
  ASSERT_EQ(run("identify halves.csv --to 8 --delay 0.004 --json half.json").exit_code, 0);
  const auto validated_on = [&](const std::string& stretch) {
    const auto done = run("validate half.json halves.csv --json - " + stretch);
    EXPECT_EQ(done.exit_code, 0) << done.error;
    return json::parse(done.out);
  };
  EXPECT_TRUE(validated_on("").at("own_record"));  // --to 8 is inherited
  const auto other = validated_on("--from 8");
  EXPECT_FALSE(other.contains("own_record"));
  EXPECT_FALSE(other.at("judged_band").at("of_model"));
  EXPECT_LT(other.at("judged_band").at("low_hz").get<double>(), 5.0);
  const auto& findings = other.at("findings");
  EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [](const json& f) {
    return f.at("id") == "other-band";
  })) << findings;
}

TEST_F(Validate, JudgesInTheBandInWhichTheModelWasIdentified) {
  for (const auto& seed : {"1", "2"})
    ASSERT_EQ(run(std::string("simulate demo --seed ") + seed + " --out d" + seed + ".csv").exit_code, 0);
  const auto fitted = run("identify d1.csv --controller pi:1.036,0.147 --delay 0.004 --json d.json");
  ASSERT_EQ(fitted.exit_code, 0) << fitted.error;
  // A disturbance of 120 Hz, far above the sweep of 1.5 ... 35 Hz, and larger than the output.
  std::istringstream rows(text("d2.csv"));
  std::ostringstream disturbed;
  std::string line;
  std::getline(rows, line);
  disturbed << line << "\n";
  ASSERT_EQ(line.substr(0, 13), "time_s,ru,u,y");
  for (int k = 0; std::getline(rows, line); ++k) {
    std::size_t from = 0;
    for (int comma = 0; comma < 3; ++comma) from = line.find(',', from) + 1;
    const auto to = std::min(line.find(',', from), line.size());
    disturbed << line.substr(0, from)
              << std::stod(line.substr(from)) + 2.0 * std::sin(2.0 * 3.14159265358979 * 0.24 * k)
              << line.substr(to) << "\n";
  }
  write("d3.csv", disturbed.str());
  const auto v = validated("d.json d3.csv");
  const auto& band = v.at("judged_band");
  EXPECT_NEAR(band.at("low_hz").get<double>(), 1.5, 0.6);
  EXPECT_NEAR(band.at("high_hz").get<double>(), 35.0, 1.0);
  EXPECT_TRUE(band.at("of_model"));
  EXPECT_FALSE(v.contains("own_record"));
  EXPECT_LT(v.at("simulation_fit_percent").get<double>(), 10.0);
  EXPECT_GT(band.at("fit_percent").get<double>(), 75.0);
  EXPECT_GT(v.at("residual").at("rms").get<double>(), 1.4);
  EXPECT_LT(band.at("residual_rms").get<double>(), 0.1);
  EXPECT_EQ(v.at("verdict"), "accepted") << v.at("findings");
  const auto said = run("validate d.json d3.csv");
  EXPECT_NE(said.out.find("Judged within 1.5 ... 35 Hz"), std::string::npos) << said.out;
}

TEST_F(Validate, WritesPageAndResidual) {
  simulate("fitted", 143.75, 1);
  identify("fitted");
  const auto done =
      run("validate fitted.json fitted.csv --report v.html --residual e.csv --max-lag 10 --json v.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("one step"), std::string::npos) << done.out;
  EXPECT_NE(text("v.html").find("Residual with simulated output"), std::string::npos);
  const auto csv = text("e.csv");
  EXPECT_EQ(csv.substr(0, csv.find('\n')), "time_s,output,simulated,residual");
  const auto rows = static_cast<std::size_t>(std::count(csv.begin(), csv.end(), '\n')) - 1;
  const auto v = json::parse(text("v.json"));
  EXPECT_EQ(rows, v.at("residual").at("samples").get<std::size_t>());
  EXPECT_EQ(v.at("residual").at("lags").size(), 21U);
}

TEST_F(Validate, TakesABlackBoxOfAPosition) {
  simulate("v", 143.75, 1);
  simulate("w", 143.75, 2);
  const std::string position =
      " --output-quantity position --output x --controller pi:1.036,0.147 --delay 0.004";
  for (const char* name : {"v", "w"}) {  // the angle, summed up from the recorded velocity
    std::istringstream lines(text(std::string(name) + ".csv"));
    std::ostringstream out;
    std::string line;
    double x = 0.0;
    while (std::getline(lines, line)) {
      if (line.empty() || line[0] == '#') continue;
      const bool header = !(line[0] == '-' || (line[0] >= '0' && line[0] <= '9'));
      if (header) {
        names_.clear();
        std::istringstream fields(line);
        for (std::string field; std::getline(fields, field, ',');) names_.push_back(field);
        out << line << ",x\n";
        continue;
      }
      std::istringstream fields(line);
      std::size_t column = 0;
      for (std::string field; std::getline(fields, field, ','); ++column)
        if (names_[column] == "y") x += 0.002 * std::stod(field);
      out << line << "," << x << "\n";
    }
    write(std::string(name) + "_x.csv", out.str());
  }
  const auto fitted = run(
      "identify v_x.csv --model black-box --order 4 --approach direct --json x.json --validate-on w_x.csv" +
      position);
  ASSERT_EQ(fitted.exit_code, 0) << fitted.error;
  EXPECT_GT(json::parse(text("x.json")).at("cross_validation").at("simulation_fit_percent").get<double>(),
            90.0);
  const auto v = run("validate x.json w_x.csv --json - --fit-band 1:40" + position);
  ASSERT_EQ(v.exit_code, 0) << v.error;
  const auto j = json::parse(v.out);
  EXPECT_GT(j.at("simulation_fit_percent").get<double>(), 90.0);
  EXPECT_TRUE(j.contains("fit_in_band"));
  EXPECT_TRUE(j.contains("expected_fit_percent"));
  const auto same = run("compare x.json x.json --json -");
  EXPECT_EQ(same.exit_code, 0) << same.error;
  expect_refused("validate x.json w.csv", {"from x.json: output, output-quantity", "'x' (--output)"});
  expect_refused("validate x.json w.csv --output y --output-quantity velocity",
                 {"--output-quantity", "position"});
}

TEST_F(Validate, TellsDryFrictionFromWhatIsLeft) {
  // Open loop around standstill: dry friction of 0.3 Nm against 2.1 Nm of excitation.
  const auto machine = [&](const std::string& name, double friction, int seed) {
    std::ostringstream toml;
    toml << "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = 143.75, damping = 0.3}\n"
         << "controller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
         << "friction = {coulomb = " << friction << "}\n"
         << "excitation = {kind = 'prbs', register_length = 13, amplitude = 2.1}\n"
         << "measurement = {noise_rms = 0.05}\nrun = {sample_rate_hz = 500, duration_s = 16, seed = " << seed
         << "}\n";
    write(name + ".toml", toml.str());
    const auto done =
        run("simulate " + name + ".toml --out " + name + ".csv --truth " + name + "_truth.json");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  };
  machine("smooth", 0.0, 1);
  machine("dry", 0.3, 2);
  write("tf.json", json::parse(text("smooth_truth.json")).at("model").at("transfer_function").dump());
  const auto found = [&](const std::string& record) {
    const auto v = validated("tf.json " + record);
    const auto& list = v.at("findings");
    return std::any_of(list.begin(), list.end(),
                       [](const json& f) { return f.at("id") == "static-nonlinearity"; });
  };
  EXPECT_TRUE(found("dry.csv"));
  EXPECT_FALSE(found("smooth.csv"));
}

TEST_F(Validate, RefusesNamingWhatWasFoundAndIsRequired) {
  simulate("r", 143.75, 1);
  write("tf.json", R"({"numerator": [0, 0.1], "denominator": [1, -1], "sample_time_s": 0.002})");
  write("slow.json", R"({"numerator": [0, 0.1], "denominator": [1, -1], "sample_time_s": 0.004})");
  write("wild.json", R"({"numerator": [0, 0.1], "denominator": [1, -1.1], "sample_time_s": 0.002})");
  write("half.json", R"({"numerator": [0, "x"], "sample_time_s": 0})");
  write("no_model.json", R"({"schema": "resonid.identification/1"})");
  write("broken.json", "[1,");
  expect_refused("validate tf.json", {"RECORD"});
  expect_refused("validate nowhere.json r.csv", {"nowhere.json", "no such file"});
  expect_refused("validate broken.json r.csv", {"broken.json", "line 1"});
  expect_refused("validate half.json r.csv",
                 {"$.numerator[1]: found \"x\", required a number", "$.denominator: found nothing",
                  "$.sample_time_s: found 0, required a number > 0"});
  expect_refused("validate no_model.json r.csv", {"$.record: found nothing"});
  expect_refused("validate slow.json r.csv", {"slow.json", "0.004", "0.002"});
  expect_refused("validate wild.json r.csv", {"wild.json", "unstable"});
  expect_refused("validate tf.json r.csv --approach indirect", {"--approach", "--controller"});
  expect_refused("validate tf.json r.csv --approach indirect --controller pi:-1,0.1",
                 {"--approach", "unstable"});
  expect_refused("validate tf.json r.csv --max-lag 0", {"--max-lag", ">= 1"});
  expect_refused("validate tf.json r.csv --delay 100", {"--delay"});
  expect_refused("validate tf.json r.csv --json tf.json", {"--json", "a file of its own"});
  expect_refused("validate tf.json r.csv --output-quantity position", {"--output-quantity", "velocity"});
  expect_refused("validate tf.json absent.csv", {"absent.csv"});
  EXPECT_EQ(run("validate tf.json r.csv --json nowhere/v.json").exit_code, 1);
}

}  // namespace
}  // namespace resonid
