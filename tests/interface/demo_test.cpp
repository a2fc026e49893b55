// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <string>

#include "program.hpp"

namespace resonid {
namespace {

class Demo : public test::ProgramTest {};

TEST_F(Demo, IdentifiesASimulatedDriveAndWritesItsPage) {
  const auto done = run("demo --json demo.json");
  EXPECT_EQ(done.exit_code, 0) << done.error;
  for (const char* part :
       {"Trusted.", "resonance 15.09 Hz", "resonid-demo.html", "resonid identify recording.csv"})
    EXPECT_NE(done.out.find(part), std::string::npos) << part << "\n" << done.out;
  EXPECT_TRUE(text("resonid-demo.html").starts_with("<!doctype html>") ||
              text("resonid-demo.html").starts_with("<!DOCTYPE html>"));
  const auto result = nlohmann::json::parse(text("demo.json"));
  EXPECT_NEAR(result.at("resonances").at(1).at("frequency_hz").get<double>(), 15.09, 0.1);
  EXPECT_TRUE(result.at("trusted"));
}

TEST_F(Demo, ReplacesItsPageAndNothingElse) {
  write("resonid-demo.html", "older");
  const auto again = run("demo --brief");
  EXPECT_NE(again.out.find("replaced in resonid-demo.html"), std::string::npos) << again.out;
  EXPECT_GT(text("resonid-demo.html").size(), 10'000U);
  EXPECT_EQ(run("demo --report other.html -q").out, "");
  EXPECT_TRUE(std::filesystem::exists(path("other.html")));
  EXPECT_NE(run("demo --report none/page.html").exit_code, 0);
  std::filesystem::create_directory(path("folder"));
  EXPECT_NE(run("demo --report folder").exit_code, 0);
}

}  // namespace
}  // namespace resonid
