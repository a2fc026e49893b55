// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "program.hpp"

namespace resonid {
namespace {

using nlohmann::json;

class Inspect : public test::ProgramTest {};

TEST_F(Inspect, ShowsColumnsAndRecordingAndTheCommandToGoOnWith) {
  ASSERT_EQ(run("simulate demo --out demo.csv").exit_code, 0);
  const auto done = run("inspect demo.csv --report page.html --json i.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  for (const char* phrase : {"8500 samples at 500 Hz", "Excitation: chirp", "Loop: closed", "no gaps",
                             "resonid identify demo.csv --controller pi:KP,TI --report demo.html"})
    EXPECT_NE(done.out.find(phrase), std::string::npos) << phrase << "\n" << done.out;
  const auto i = json::parse(text("i.json"));
  EXPECT_EQ(i.at("schema"), "resonid.inspection/1");
  EXPECT_EQ(i.at("columns").size(), 5U);
  EXPECT_EQ(i.at("recording").at("record").at("signals").at("input"), "u");
  EXPECT_NEAR(i.at("recording").at("excitation").at("high_hz").get<double>(), 35.0, 0.5);
  const auto page = text("page.html");
  for (const char* phrase : {"Spectrum of y", "What the file holds", "Sample rate"})
    EXPECT_NE(page.find(phrase), std::string::npos) << phrase;
}

TEST_F(Inspect, ShowsTheColumnsOfAFileThatIsNoRecordingYet) {
  std::string file = "time;M1;n_act [1/min]\n";
  for (int k = 0; k < 200; ++k)
    file += std::to_string(0.001 * k) + ";" + std::to_string(k % 7) + ";" + std::to_string(k % 5) + "\n";
  write("axis.csv", file);
  const auto done = run("inspect axis.csv");
  EXPECT_EQ(done.exit_code, 0) << done.error;
  for (const char* phrase :
       {"No recording yet", "n_act [1/min]  1/min  velocity", "resonid identify axis.csv --input COL"})
    EXPECT_NE(done.out.find(phrase), std::string::npos) << phrase << "\n" << done.out;
  expect_refused("inspect nowhere.csv", {"there is no such file"});
}

TEST_F(Inspect, WritesACommandThatAShellReads) {
  ASSERT_EQ(run("simulate demo --out 'my file.csv'").exit_code, 0);
  const auto done = run("inspect 'my file.csv' --output '2*y - y'");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  const auto at = done.out.find("resonid identify 'my file.csv' --output '2*y - y'");
  EXPECT_NE(at, std::string::npos) << done.out;
  EXPECT_NE(done.out.find("--report 'my file.html'"), std::string::npos) << done.out;
}

TEST_F(Inspect, ReadsStandardInput) {
  ASSERT_EQ(run("simulate demo --out demo.csv").exit_code, 0);
  const auto done = run("inspect - --json - < demo.csv");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_EQ(json::parse(done.out).at("file"), "standard input");
}

}  // namespace
}  // namespace resonid
