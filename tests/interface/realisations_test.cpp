// SPDX-License-Identifier: MIT
// From the command line: excitation with realisations, a simulated drive with dry friction, its best linear
// approximation, from one record and from several.
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/io/detail/table.hpp>
#include <sstream>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

constexpr const char* kKnown = " --controller pi:1.036,0.147 --delay 0.004 --model none ";

class Realisations : public test::ProgramTest {
 protected:
  /// The published drive at rest, dry friction in its motor, lines 2 ... 39.5 Hz; writes NAME.csv.
  void simulate(const std::string& name, double coulomb, const std::string& excitation, double seconds,
                int seed) const {
    std::ostringstream toml;
    toml << "drive = {driven_inertia = 0.032, load_inertia = 0.032, stiffness = 143.75, damping = 0.3}\n"
         << "friction = {coulomb = " << coulomb << "}\n"
         << "controller = {kind = 'pi', gain = 1.036, integral_time_s = 0.147}\n"
         << "excitation = {kind = 'multisine', lines_hz = '2:39.5:0.5', amplitude = 0.3, phases = 'random', "
         << "seed = " << seed << excitation << "}\n"
         << "measurement = {delay_s = 0.004, noise_rms = 0.001}\n"
         << "run = {sample_rate_hz = 500, duration_s = " << seconds << ", seed = " << seed << "}\n";
    write(name + ".toml", toml.str());
    const auto done = run("simulate " + name + ".toml --out " + name + ".csv");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  void simulate_realisations(const std::string& name, double coulomb) const {
    simulate(name, coulomb, ", periods_per_realisation = 4, leave_out = 'odd-random'", 32.0, 1);
  }
  [[nodiscard]] json parsed(const std::string& name) const { return json::parse(text(name)); }
  static const json* finding(const json& result) {
    for (const auto& f : result.at("findings"))
      if (f.at("id") == "non-linear-distortion") return &f;
    return nullptr;
  }
};

TEST_F(Realisations, AreRecognisedAndTellDistortionFromNoise) {
  simulate_realisations("dry", 0.2);
  const auto done =
      run("identify dry.csv" + std::string(kKnown) + "--json o.json --response o.csv --report o.html");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto j = parsed("o.json");
  EXPECT_EQ(j.at("method"), "best-linear");
  EXPECT_NE(j.at("choices")[1].at("because").get<std::string>().find("4 realisations"), std::string::npos);
  const auto& d = j.at("distortion");
  EXPECT_EQ(d.at("realisations"), 4);
  EXPECT_TRUE(d.at("scatter").at("significant").get<bool>());
  EXPECT_TRUE(d.at("detection_lines").at("odd").at("significant").get<bool>());
  const auto lines = j.at("frequency_response").at("frequency_hz").size();
  EXPECT_EQ(d.at("noise_std").size(), lines);
  EXPECT_EQ(d.at("distortion_std").size(), lines);
  ASSERT_NE(finding(j), nullptr);
  EXPECT_NE(done.out.find("Non-linear distortion: by 4 realisations"), std::string::npos) << done.out;
  const auto table = io::read_csv(path("o.csv")).value();
  EXPECT_EQ(table.names, (std::vector<std::string>{"frequency_hz", "real", "imag", "std", "coherence",
                                                   "noise_std", "distortion_std"}));
  EXPECT_EQ(table.columns[6].size(), lines);
  EXPECT_EQ(table.columns[6][3], d.at("distortion_std")[3].get<double>());
  EXPECT_NE(text("o.html").find("distortion_std"), std::string::npos);
}

TEST_F(Realisations, ALinearDriveShowsNone) {
  simulate_realisations("linear", 0.0);
  ASSERT_EQ(run("identify linear.csv" + std::string(kKnown) + "--json o.json").exit_code, 0);
  const auto j = parsed("o.json");
  EXPECT_EQ(j.at("method"), "best-linear");
  EXPECT_FALSE(j.at("distortion").at("scatter").at("significant").get<bool>());
  EXPECT_EQ(finding(j), nullptr);
}

TEST_F(Realisations, AreRefusedWhereThereAreNone) {
  simulate("one", 0.0, "", 8.0, 1);
  expect_refused("identify one.csv --method best-linear",
                 {"--method", "best-linear", "two realisations", "--join"});
  simulate_realisations("four", 0.0);
  expect_refused("identify four.csv --method periodic", {"--method", "periodic", "best-linear"});
}

TEST_F(Realisations, RecordsOfOneEachAreJoined) {
  for (int seed = 1; seed <= 4; ++seed) simulate("r" + std::to_string(seed), 0.2, "", 8.0, seed);
  const auto done = run("identify r1.csv r2.csv r3.csv r4.csv --join --method best-linear" +
                        std::string(kKnown) + "--json o.json --response o.csv");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto j = parsed("o.json");
  for (const auto& r : j.at("results")) EXPECT_EQ(r.at("method"), "periodic");
  const auto& joint = j.at("joint").at("result");
  EXPECT_EQ(joint.at("method"), "best-linear") << joint.dump().substr(0, 400);
  EXPECT_EQ(joint.at("distortion").at("realisations"), 4);
  EXPECT_TRUE(joint.at("distortion").at("scatter").at("significant").get<bool>());
  EXPECT_NE(text("o.csv").find(",noise_std,distortion_std"), std::string::npos);
  simulate("again", 0.2, "", 8.0, 1);
  expect_refused("identify r1.csv r2.csv again.csv --join --method best-linear" + std::string(kKnown),
                 {"--join", "r1.csv", "again.csv", "same samples"});
}

}  // namespace
}  // namespace resonid
