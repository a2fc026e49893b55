// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <sstream>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

constexpr const char* kKnown = " --controller pi:1.036,0.147 --delay 0.004 ";

class IdentifyMany : public test::ProgramTest {
 protected:
  /// Two seconds and a half of PRBS on the published drive.
  void simulate(const std::string& name, int seed, double stiffness = 143.75) const {
    std::ostringstream toml;
    toml << "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = " << stiffness
         << ", damping = 0.3}\n"
         << "controller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
         << "excitation = {kind = 'prbs', register_length = 9}\n"
         << "measurement = {delay_s = 0.004, noise_rms = 0.05}\n"
         << "run = {sample_rate_hz = 500, duration_s = 2.5, seed = " << seed << "}\n"
         << "motion = {kind = 'constant', velocity = 10.0}\n";
    write(name + ".toml", toml.str());
    const auto done = run("simulate " + name + ".toml --out " + name + ".csv");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    std::filesystem::remove(path(name + ".toml"));
  }
  void simulate_three() const {
    for (int seed = 1; seed <= 3; ++seed) simulate("r" + std::to_string(seed), seed);
  }
  [[nodiscard]] json parsed(const std::string& name) const { return json::parse(text(name), nullptr, false); }
  [[nodiscard]] bool exists(const std::string& name) const { return std::filesystem::exists(path(name)); }
};

bool holds_null(const json& j) {
  if (j.is_null()) return true;
  if (!j.is_structured()) return false;
  for (const auto& part : j)
    if (holds_null(part)) return true;
  return false;
}

TEST_F(IdentifyMany, WritesOneTableOneJsonAndOneReport) {
  simulate_three();
  const auto done =
      run("identify r1.csv r2.csv r3.csv" + std::string(kKnown) + "--json o.json --report o.html");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  for (const char* word :
       {"r1.csv", "r2.csv", "r3.csv", "stiffness", "Over the recordings", "trusted", "o.html"})
    EXPECT_NE(done.out.find(word), std::string::npos) << word << "\n" << done.out;
  std::istringstream lines(done.out);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 110U) << line;
  const auto j = parsed("o.json");
  ASSERT_TRUE(j.is_object());
  EXPECT_FALSE(holds_null(j));
  EXPECT_EQ(j.at("schema"), "resonid.identifications/1");
  ASSERT_EQ(j.at("results").size(), 3U);
  EXPECT_FALSE(j.contains("joint"));
  // What one by one gives, and the name of the file.
  for (int i = 0; i < 3; ++i) {
    const std::string file = "r" + std::to_string(i + 1) + ".csv";
    const auto single = run("identify " + file + kKnown + "--json -");
    auto expected = json::parse(single.out, nullptr, false);
    expected.erase("provenance");  // of the file, not of the result
    expected["file"] = file;
    EXPECT_EQ(j.at("results").at(static_cast<std::size_t>(i)), expected) << file;
  }
  bool found = false;
  for (const auto& f : j.at("table").at("figures")) {
    EXPECT_TRUE(f.at("values").size() <= 3U);
    if (f.at("name") != "stiffness") continue;
    found = true;
    EXPECT_EQ(f.at("unit"), "Nm/rad");
    EXPECT_EQ(f.at("degrees_of_freedom"), 2);
    EXPECT_TRUE(f.at("agrees").get<bool>());
    EXPECT_NEAR(f.at("mean").get<double>(), 143.75, 4.0 * f.at("std").get<double>());
  }
  EXPECT_TRUE(found);
  const auto page = text("o.html");
  for (const char* word : {"All responses", "All loops", "Over the recordings", "<details>", "r3.csv",
                           "Parameters over the recordings", "class=\"whisker\"", "SHA-256 "})
    EXPECT_NE(page.find(word), std::string::npos) << word;
  EXPECT_EQ(page.find("src="), std::string::npos);
}

TEST_F(IdentifyMany, TakesAFolderInTheOrderOfItsNames) {
  simulate_three();
  std::filesystem::create_directories(path("bench"));
  for (const char* name : {"r2.csv", "r1.csv"}) std::filesystem::rename(path(name), path("bench") / name);
  write("bench/notes.txt", "no record");
  const auto done = run("identify bench r3.csv" + std::string(kKnown) + "--jobs 1 --json -");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto j = json::parse(done.out, nullptr, false);
  ASSERT_EQ(j.at("results").size(), 3U);
  EXPECT_EQ(j.at("results").at(0).at("file"), "bench/r1.csv");
  EXPECT_EQ(j.at("results").at(1).at("file"), "bench/r2.csv");
  EXPECT_EQ(j.at("results").at(2).at("file"), "r3.csv");
  std::filesystem::create_directories(path("empty"));
  expect_refused("identify empty", {"empty", ".csv"});
}

TEST_F(IdentifyMany, GivesABrokenRecordARowAndEndsWithTwo) {
  simulate_three();
  write("r2.csv", "time_s,u,y\n0,1,2\n0.002,x,3\n");
  const auto done =
      run("identify r1.csv r2.csv r3.csv absent.csv" + std::string(kKnown) + "--json o.json --report o.html");
  EXPECT_EQ(done.exit_code, 2);
  for (const char* word : {"2 of 4 recordings", "r2.csv", "absent.csv", "line 3"})
    EXPECT_NE(done.error.find(word), std::string::npos) << word << "\n" << done.error;
  EXPECT_NE(done.out.find("error"), std::string::npos) << done.out;
  const auto j = parsed("o.json");
  ASSERT_TRUE(j.is_object());
  ASSERT_EQ(j.at("results").size(), 4U);
  EXPECT_TRUE(j.at("results").at(0).contains("model"));
  EXPECT_EQ(j.at("results").at(1).at("file"), "r2.csv");
  EXPECT_NE(j.at("results").at(1).at("error").get<std::string>().find("line 3"), std::string::npos);
  EXPECT_FALSE(j.at("results").at(1).contains("model"));
  EXPECT_TRUE(exists("o.html"));
}

TEST_F(IdentifyMany, WritesNothingWhenNoRecordCanBeRead) {
  write("a.csv", "time_s,u,y\n0,1,2\n");
  const auto done = run("identify a.csv b.csv --json o.json --report o.html");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_EQ(done.out, "");
  EXPECT_FALSE(exists("o.json"));
  EXPECT_FALSE(exists("o.html"));
}

TEST_F(IdentifyMany, JoinsRepetitions) {
  simulate_three();
  const auto done = run("identify r1.csv r2.csv r3.csv --join" + std::string(kKnown) +
                        "--json o.json --response o.csv --report o.html");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("Joint estimate: trusted"), std::string::npos) << done.out;
  const auto j = parsed("o.json");
  ASSERT_TRUE(j.is_object());
  EXPECT_FALSE(holds_null(j));
  const auto& joint = j.at("joint");
  EXPECT_EQ(joint.at("result").at("schema"), "resonid.identification/1");
  ASSERT_EQ(joint.at("records").size(), 3U);
  for (const auto& r : joint.at("records"))
    EXPECT_TRUE(r.at("agrees").get<bool>() && r.at("own_estimate").get<bool>());
  EXPECT_NE(joint.at("result").at("choices").dump().find("one likelihood over 3 recordings"),
            std::string::npos);
  const auto stiffness = [](const json& result) {
    return result.at("model").at("parameters").at("stiffness");
  };
  const double joined = stiffness(joint.at("result")).at("std").get<double>();
  const double one = stiffness(j.at("results").at(0)).at("std").get<double>();
  EXPECT_NEAR(joined / one, 1.0 / std::sqrt(3.0), 0.15);
  EXPECT_NE(text("o.csv").find("frequency_hz"), std::string::npos);
  EXPECT_NE(text("o.html").find("Joint estimate"), std::string::npos);
}

/// A joint result is a result: bootstrapped on demand, and taken by every verb that takes one.
TEST_F(IdentifyMany, JointResultsAreReadByEveryVerb) {
  simulate_three();
  simulate("other", 4);
  const auto done = run("identify r1.csv r2.csv r3.csv --join --bootstrap 40 --jobs 2 --json joint.json" +
                        std::string(kKnown));
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto result = parsed("joint.json").at("joint").at("result");
  const auto& bootstrap = result.at("bootstrap");
  EXPECT_GE(bootstrap.at("replicas").get<int>(), 38);
  for (const auto& i : bootstrap.at("intervals")) {
    if (i.at("name") != "stiffness") continue;
    const double by_covariance = result.at("model").at("parameters").at("stiffness").at("std").get<double>();
    EXPECT_NEAR(i.at("std").get<double>() / by_covariance, 1.0, 0.4);  // 40 replicas: 11 %
  }
  const auto validated = run("validate joint.json other.csv --json v.json" + std::string(kKnown));
  ASSERT_EQ(validated.exit_code, 0) << validated.error;
  EXPECT_EQ(parsed("v.json").at("verdict"), "accepted") << validated.out;
  ASSERT_EQ(run("identify other.csv --json one.json" + std::string(kKnown)).exit_code, 0);
  const auto compared = run("compare joint.json one.json --require-unchanged");
  EXPECT_EQ(compared.exit_code, 0) << compared.error << compared.out;
  EXPECT_NE(compared.out.find("3 recordings joined"), std::string::npos) << compared.out;
  const auto planned =
      run("plan --model joint.json --controller pi:1.036,0.147 --max-torque 1 --type chirp --accuracy "
          "resonance=1% --json -");
  EXPECT_EQ(planned.exit_code, 0) << planned.error;
  const auto tracked = run("track other.csv --start joint.json --json t.json" + std::string(kKnown));
  EXPECT_EQ(tracked.exit_code, 0) << tracked.error;
  EXPECT_NE(tracked.out.find("100 % of the rows after the start"), std::string::npos) << tracked.out;
}

TEST_F(IdentifyMany, DoesNotTrustWhatDisagrees) {
  simulate("a", 1);
  simulate("b", 2);
  simulate("c", 3, 170.0);
  const auto done =
      run("identify a.csv b.csv c.csv --join --require-trusted" + std::string(kKnown) + "--json o.json");
  EXPECT_EQ(done.exit_code, 3) << done.error;
  EXPECT_NE(done.out.find("records-disagree"), std::string::npos) << done.out;
  EXPECT_NE(done.out.find("DIFFERS"), std::string::npos) << done.out;
}

TEST_F(IdentifyMany, ValidatesOnAnotherRecord) {
  simulate("a", 1);
  simulate("b", 2);
  simulate("other", 3, 300.0);
  const auto same = run("identify a.csv --validate-on b.csv --json o.json" + std::string(kKnown));
  ASSERT_EQ(same.exit_code, 0) << same.error;
  EXPECT_NE(same.out.find("b.csv, to which it was not fitted"), std::string::npos) << same.out;
  const auto v = parsed("o.json").at("cross_validation");
  EXPECT_EQ(v.at("file"), "b.csv");
  // The response of so short a record is smoothed: "doubtful" is as much as it can say for a true model.
  EXPECT_NE(v.at("verdict"), "rejected");
  EXPECT_NEAR(v.at("simulation_fit_percent").get<double>(),
              parsed("o.json").at("validation").at("fit_percent").get<double>(), 2.0);
  const auto changed =
      run("identify a.csv --validate-on other.csv --require-trusted --json o.json" + std::string(kKnown));
  EXPECT_NE(parsed("o.json").at("cross_validation").at("verdict"), "accepted");
  EXPECT_NE(changed.out.find("fails-elsewhere"), std::string::npos) << changed.out;
  const auto many =
      run("identify a.csv b.csv --join --validate-on other.csv --json o.json" + std::string(kKnown));
  EXPECT_EQ(many.exit_code, 0) << many.error;
  EXPECT_TRUE(parsed("o.json").at("joint").at("result").contains("cross_validation"));
}

TEST_F(IdentifyMany, RefusesWhatItWouldIgnore) {
  simulate("a", 1);
  simulate("b", 2);
  expect_refused("identify a.csv --join", {"--join", "found 1 recording", "at least 2"});
  expect_refused("identify a.csv b.csv --join --model black-box", {"--join", "black box", "--model auto"});
  expect_refused("identify a.csv b.csv --response o.csv", {"--response", "--join", "2 recordings"});
  expect_refused("identify a.csv --order 3", {"--order", "--model black-box"});
  expect_refused("identify a.csv --model black-box --order 21", {"--order", "found 21", "1 ... 20"});
  expect_refused("identify a.csv --seed 3", {"--seed", "--bootstrap"});
  expect_refused("identify a.csv --bootstrap 5", {"--bootstrap", "found 5", ">= 20"});
  expect_refused("identify a.csv --bootstrap 50 --model none", {"--bootstrap", "--model"});
  expect_refused("identify a.csv --validate-on b.csv --model none", {"--validate-on", "--model"});
  expect_refused("identify a.csv --validate-on a.csv", {"--validate-on", "a.csv"});
  expect_refused("identify a.csv --validate-on nothing.csv", {"--validate-on", "nothing.csv"});
  expect_refused("identify a.csv b.csv --json b.csv", {"--json", "b.csv"});
  expect_refused("identify a.csv b.csv --json - --report -", {"--json", "--report"});
  const auto unwritable = run("identify a.csv b.csv --report absent/o.html --json o.json");
  EXPECT_EQ(unwritable.exit_code, 1) << unwritable.error;
  EXPECT_FALSE(exists("o.json"));
}

TEST_F(IdentifyMany, RefusesToJoinDifferentRates) {
  simulate("a", 1);
  std::ostringstream record;
  record << "time_s,u,y\n";
  for (int k = 0; k < 2000; ++k)
    record << 0.001 * k << "," << ((k * k) % 7 < 3 ? 1 : -1) << "," << 0.01 * (k % 13) << "\n";
  write("b.csv", record.str());
  const auto done = run("identify a.csv b.csv --join --delay 0.004 --json o.json");
  EXPECT_EQ(done.exit_code, 2);
  for (const char* word : {"--join", "sample rate", "500 Hz", "1000 Hz"})
    EXPECT_NE(done.error.find(word), std::string::npos) << word << "\n" << done.error;
  EXPECT_FALSE(exists("o.json"));
}

TEST_F(IdentifyMany, BootstrapsOnDemand) {
  simulate("a", 1);
  const auto done = run("identify a.csv --bootstrap 20 --seed 3 --jobs 2 --json o.json --report o.html" +
                        std::string(kKnown));
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.out.find("Bootstrap, 20 replicas"), std::string::npos) << done.out;
  const auto b = parsed("o.json").at("bootstrap");
  EXPECT_EQ(b.at("replicas").get<int>() + b.at("failed").get<int>(), 20);
  for (const auto& i : b.at("intervals")) EXPECT_LT(i.at("low").get<double>(), i.at("high").get<double>());
}

}  // namespace
}  // namespace resonid
