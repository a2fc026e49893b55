// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <string>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class Profile : public test::ProgramTest {
 protected:
  /// A record whose columns no verb finds by itself, of an encoder mounted the wrong way round.
  void record(const std::string& name, int seed) const {
    ASSERT_EQ(run("simulate demo --seed " + std::to_string(seed) + " --no-profile --out plain.csv").exit_code,
              0);
    ASSERT_EQ(
        shell(
            "awk -F, 'NR == 1 { print \"seconds,a,b,c\"; next } { print $1 \",\" $2 \",\" $3 \",\" (-$4) }' "
            "plain.csv > " +
            name)
            .exit_code,
        0);
  }
  [[nodiscard]] static std::string told() {
    return "time = \"seconds\"\nexcitation = \"a\"\ninput = \"b\"\noutput = \"c\"\noutput-scale = -1\n"
           "controller = \"pi:1.036,0.147\"\ndelay = 0.004\n";
  }
  [[nodiscard]] static std::string as_options() {
    return " --time seconds --excitation a --input b --output c --output-scale=-1 --controller "
           "pi:1.036,0.147 "
           "--delay 0.004";
  }
};

TEST_F(Profile, GivesDefaultsToEveryVerb) {
  record("run.csv", 1);
  expect_refused("identify run.csv", {"run.csv"});
  const auto by_options = run("identify run.csv --json -" + as_options());
  ASSERT_EQ(by_options.exit_code, 0) << by_options.error;
  write("resonid.toml", told() + "chirp = [35, 1.5, 17]\n[identify]\nbrief = true\n[compare]\nweight = 1\n");
  const auto by_profile = run("identify run.csv");
  EXPECT_EQ(by_profile.exit_code, 0) << by_profile.error;
  EXPECT_TRUE(by_profile.out.starts_with("Trusted.\n")) << by_profile.out;
  EXPECT_EQ(by_profile.error,
            "resonid: profile resonid.toml: time, input, output, excitation, output-scale, chirp, "
            "controller, delay, "
            "brief\n");
  auto a = json::parse(by_options.out), b = json::parse(run("identify run.csv --json -").out);
  EXPECT_EQ(a.at("model"), b.at("model"));
  EXPECT_EQ(run("track run.csv").exit_code, 0);
  expect_refused("identify run.csv --no-profile", {"run.csv"});
  std::filesystem::rename(path("resonid.toml"), path("bench.toml"));
  expect_refused("identify run.csv", {"run.csv"});
  EXPECT_EQ(run("identify run.csv --profile bench.toml").exit_code, 0);
  EXPECT_EQ(run("identify --profile=bench.toml run.csv -q").error, "");
  expect_refused("identify run.csv --profile none.toml", {"none.toml"});
  expect_refused("identify run.csv --profile bench.toml --no-profile", {"--profile", "--no-profile"});
}

TEST_F(Profile, IsOverruledByOptions) {
  record("run.csv", 1);
  write("resonid.toml", told() + "input-scale = 3\nmotion = 'linear'\n[identify]\ninput-scale = 2\n");
  const auto result = [&](const std::string& more) {
    return json::parse(run("identify run.csv --json -" + more).out);
  };
  const auto inertia = [](const json& r) {
    return r.at("model").at("parameters").at("driven_inertia").at("value").get<double>();
  };
  const auto twice = result(""), once = result(" --input-scale 1 --motion rotary");
  EXPECT_NEAR(inertia(twice), 2.0 * inertia(once),
              0.01 * inertia(once));  // the verb's table before the common one
  EXPECT_EQ(once.at("model").at("parameters").at("driven_inertia").at("unit"), "kgm2");
  EXPECT_EQ(twice.at("options").at("input-scale"), "2");
}

TEST_F(Profile, GivesFlagsAndKindsOfAVerb) {
  write("resonid.toml",
        "sample-rate = 500\n[excite]\namplitude = 2\n[excite.chirp]\nfrom = 35\nto = 1.5\n"
        "duration = 17\nrepeat = false\n");
  const auto done = run("excite chirp --json -");
  EXPECT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NEAR(json::parse(done.out).at("peak").get<double>(), 2.0, 0.01);
  EXPECT_NE(done.error.find("profile resonid.toml:"), std::string::npos) << done.error;
  EXPECT_EQ(run("help excite").exit_code, 0);
}

TEST_F(Profile, RefusesWhatItDoesNotKnow) {
  record("run.csv", 1);
  const auto refused = [&](const std::string& profile, std::initializer_list<const char*> words) {
    write("resonid.toml", profile);
    expect_refused("identify run.csv", words);
  };
  refused("input = \"b\"\noutput-scal = -1\n",
          {"resonid.toml:2:1", "'output-scal'", "did you mean 'output-scale'", "--no-profile"});
  refused("[identfy]\ninput = \"b\"\n", {"resonid.toml:1:2", "'identfy'", "did you mean 'identify'"});
  refused("[track]\nchrip = 1\n", {"resonid.toml:2:1", "'chrip'", "did you mean 'chirp'", "resonid track"});
  refused("input = [\n", {"resonid.toml:", "not TOML"});
  refused("differentiate = 3\n", {"resonid.toml:1:1", "true or false"});
  refused("input = true\n", {"resonid.toml:1:1", "'input' requires a value"});
  refused("input = 1979-05-27\n", {"resonid.toml:1:9", "'input' requires a text"});
  refused("time = 'seconds'\noutput-scale = 'x'\n", {"--output-scale", "found 'x'", "(resonid.toml:2:1)"});
  refused("help = true\n", {"unknown key 'help'"});
}

TEST_F(Profile, IsWrittenByIdentify) {
  record("run.csv", 1);
  ASSERT_EQ(
      run("identify run.csv --json first.json --save-profile saved.toml --model two-mass --confidence 0.9" +
          as_options())
          .exit_code,
      0);
  const auto saved = text("saved.toml");
  for (const char* line : {"time = \"seconds\"", "output-scale = -1", "controller = \"pi:1.036,0.147\"",
                           "delay = 0.004", "[identify]\n", "model = \"two-mass\"", "confidence = 0.9"})
    EXPECT_NE(saved.find(line), std::string::npos) << line << "\n" << saved;
  ASSERT_EQ(run("identify run.csv --json second.json --profile saved.toml").exit_code, 0);
  for (const char* key : {"model", "options", "confidence"})
    EXPECT_EQ(json::parse(text("first.json")).at(key), json::parse(text("second.json")).at(key)) << key;
  ASSERT_EQ(run("simulate demo --out demo.csv").exit_code, 0);
  ASSERT_EQ(run("identify demo.csv --save-profile found.toml").exit_code, 0);
  EXPECT_NE(text("found.toml").find("input = \"u\"\noutput = \"y\"\nexcitation = \"ru\"\n"),
            std::string::npos)
      << text("found.toml");
  expect_refused("identify demo.csv plain.csv --save-profile many.toml",
                 {"--save-profile", "single recording"});
  expect_refused("identify demo.csv --save-profile demo.csv", {"--save-profile", "the input"});
}

TEST_F(Profile, ResultsTellTheVerbsThatReadThem) {
  record("january.csv", 1);
  record("june.csv", 2);
  ASSERT_EQ(run("identify january.csv --json january.json --chirp 35:1.5:17" + as_options()).exit_code, 0);
  ASSERT_EQ(run("identify june.csv --json june.json" + as_options()).exit_code, 0);
  const auto with = run("validate january.json june.csv --json -" + as_options());
  const auto without = run("validate january.json june.csv --json -");
  ASSERT_EQ(without.exit_code, 0) << without.error;
  for (const char* key : {"residual", "verdict", "simulation_fit_percent"})
    EXPECT_EQ(json::parse(with.out).at(key), json::parse(without.out).at(key)) << key;
  EXPECT_EQ(without.error,
            "resonid: from january.json: time, input, output, excitation, output-scale, controller, delay\n");
  // The same record: its excitation too.
  EXPECT_NE(run("validate january.json january.csv").error.find("chirp"), std::string::npos);
  for (const char* option : {"--result", "--baseline", "--start"}) {
    const auto tracked = run(std::string("track june.csv --json - ") + option + " january.json");
    EXPECT_EQ(tracked.exit_code, 0) << tracked.error;
    EXPECT_NE(tracked.error.find("from january.json: time, input"), std::string::npos) << tracked.error;
    const auto told_again =
        run(std::string("track june.csv --json - ") + option + " january.json" + as_options());
    for (const char* key : {"trusted", "method", "start"})
      EXPECT_EQ(json::parse(tracked.out).value(key, json()), json::parse(told_again.out).value(key, json()))
          << key;
    EXPECT_EQ(json::parse(tracked.out).at("over_time"), json::parse(told_again.out).at("over_time"))
        << option;
  }
  const auto compared = run("compare january.json june.json");
  EXPECT_EQ(compared.exit_code, 0) << compared.error;
  EXPECT_EQ(compared.error, "resonid: from january.json: controller\n");
  EXPECT_EQ(run("compare january.json june.json --weight 1").error, "");
}

TEST_F(Profile, ResultsAreOverruledByOptionsAndOverruleAProfile) {
  record("run.csv", 1);
  ASSERT_EQ(run("identify run.csv --json run.json" + as_options()).exit_code, 0);
  write("resonid.toml", "output-scale = 5\ninput-scale = 1\n");
  const auto done = run("validate run.json run.csv --delay 0.003");
  EXPECT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(done.error.find("from run.json: time, input, output, excitation, output-scale, controller\n"),
            std::string::npos)
      << done.error;
  EXPECT_NE(done.error.find("profile resonid.toml: input-scale\n"), std::string::npos) << done.error;
  // A broken file says which.
  auto result = json::parse(text("run.json"));
  result["options"]["output-scale"] = "x";
  write("broken.json", result.dump());
  expect_refused("validate broken.json run.csv", {"broken.json", "--output-scale", "'x'"});
  result["options"]["output-scale"] = 3;
  write("broken.json", result.dump());
  EXPECT_EQ(run("compare broken.json run.json").exit_code, 2);
}

TEST_F(Profile, AControllersFileNeedNotBeThereAgain) {
  ASSERT_EQ(run("simulate demo --out run.csv").exit_code, 0);
  write("c.json", R"({"numerator": [1.0501, -1.036], "denominator": [1, -1], "sample_time_s": 0.002})");
  ASSERT_EQ(run("identify run.csv --controller c.json --delay 0.004 --json run.json").exit_code, 0);
  const auto with = run("validate run.json run.csv --controller c.json --json -");
  std::filesystem::remove(path("c.json"));
  const auto without = run("validate run.json run.csv --json -");
  ASSERT_EQ(without.exit_code, 0) << without.error;
  for (const char* key : {"residual", "verdict", "simulation_fit_percent"})
    EXPECT_EQ(json::parse(with.out).at(key), json::parse(without.out).at(key)) << key;
}

}  // namespace
}  // namespace resonid
