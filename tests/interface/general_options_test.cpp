// SPDX-License-Identifier: MIT
#include <algorithm>
#include <string>

#include "program.hpp"

namespace resonid {
namespace {

class GeneralOptions : public test::ProgramTest {
 protected:
  void simulate() const {
    const auto done = run("simulate demo --out demo.csv");
    ASSERT_EQ(done.exit_code, 0) << done.error;
  }
  /// What the program says on a terminal.
  [[nodiscard]] std::string on_terminal(const std::string& arguments,
                                        const std::string& environment = "") const {
    return shell("TERM=xterm " + environment + " script -qec \"'" RESONID_PROGRAM "' " + arguments +
                 "\" /dev/null < /dev/null")
        .out;
  }
};

TEST_F(GeneralOptions, QuietSaysNothingButErrors) {
  simulate();
  for (const char* arguments : {"simulate demo -q --out again.csv", "identify demo.csv -q --json result.json",
                                "-q track demo.csv --out rows.csv", "validate result.json demo.csv --quiet",
                                "compare result.json result.json -q", "identify demo.csv -qv"}) {
    const auto done = run(arguments);
    EXPECT_EQ(done.exit_code, 0) << arguments;
    EXPECT_EQ(done.out + done.error, "") << arguments;
  }
  expect_refused("identify none.csv -q", {"none.csv"});
  EXPECT_NE(run("identify demo.csv -q --json -").out.find("resonid.identification/1"), std::string::npos);
}

/// Texts are typeset where the locale is UTF-8, unless --ascii is given; what machines read never is.
TEST_F(GeneralOptions, TextsAreTypesetWhereTheyCanBeRead) {
  simulate();
  const auto identify = [&](const std::string& locale, const std::string& more = "") {
    return shell("unset LC_ALL LC_CTYPE LANG; " + locale + " '" RESONID_PROGRAM "' identify demo.csv " + more)
        .out;
  };
  const auto is_ascii = [](const std::string& text) {
    return std::none_of(text.begin(), text.end(), [](unsigned char c) { return c > 127; });
  };
  const auto set = identify("LANG=de_DE.UTF-8");
  EXPECT_NE(set.find(" \u00b1 "), std::string::npos) << set;
  EXPECT_NE(set.find(" kg m\u00b2\n"), std::string::npos) << set;
  EXPECT_EQ(identify("LC_CTYPE=C.utf8"), set);
  for (const auto& plain :
       {identify(""), identify("LANG=de_DE.UTF-8 LC_ALL=C"), identify("LANG=C.UTF-8", "--ascii"),
        identify("LANG=C.UTF-8", "--json -"), identify("LANG=C.UTF-8", "--response -")})
    EXPECT_TRUE(is_ascii(plain)) << plain;
  EXPECT_NE(identify("").find(" +- "), std::string::npos);
  EXPECT_NE(identify("").find(" kg m2\n"), std::string::npos);
  EXPECT_NE(shell("LC_ALL=C.UTF-8 '" RESONID_PROGRAM "' identify --help").out.find("kg m\u00b2"),
            std::string::npos);
  EXPECT_TRUE(is_ascii(shell("LC_ALL=C.UTF-8 '" RESONID_PROGRAM "' --ascii identify --help").out));
}

TEST_F(GeneralOptions, VerboseTellsStagesWithTimes) {
  simulate();
  const auto done = run("identify demo.csv -v --json result.json");
  EXPECT_NE(done.out.find("Trusted"), std::string::npos);
  for (const char* stage : {"reading demo.csv", "measuring the response",
                            "fitting a two-mass model to the recording", "margins of the loop", "writing"})
    EXPECT_NE(done.error.find(stage), std::string::npos) << stage << "\n" << done.error;
  EXPECT_TRUE(done.error.starts_with("resonid:    0.0")) << done.error;
  EXPECT_EQ(run("identify demo.csv").error, "");  // no terminal, nothing asked for
}

TEST_F(GeneralOptions, BriefGivesTheVerdictAndTheKeyFigures) {
  simulate();
  const auto done = run("identify demo.csv --brief --json result.json");
  EXPECT_TRUE(done.out.starts_with("Trusted.\n")) << done.out;
  EXPECT_NE(done.out.find("resonance"), std::string::npos);
  EXPECT_LT(std::count(done.out.begin(), done.out.end(), '\n'), 12);
  const auto whole = run("identify demo.csv");
  EXPECT_GT(whole.out.size(), 2 * done.out.size());
  EXPECT_TRUE(run("validate result.json demo.csv --brief").out.starts_with("Accepted.\n"));
  EXPECT_TRUE(run("compare result.json result.json --brief").out.starts_with("No change shown.\n"));
  const auto track = run("track demo.csv --brief").out;
  EXPECT_TRUE(track.starts_with("Trusted.\n") || track.starts_with("NOT trusted.\n")) << track;
}

TEST_F(GeneralOptions, ColoursOnATerminalOnly) {
  simulate();
  const std::string colour = "\x1b[1;";
  EXPECT_EQ(run("identify demo.csv").out.find('\x1b'), std::string::npos);
  EXPECT_NE(run("identify demo.csv --color always").out.find("\x1b[1;32mTrusted"), std::string::npos);
  EXPECT_NE(run("identify none.csv --color=always").error.find("\x1b[1;31mresonid:"), std::string::npos);
  EXPECT_NE(run("--color=always identfy").error.find("\x1b[1;31mresonid:"), std::string::npos);
  EXPECT_EQ(run("identify none.csv").error.find('\x1b'), std::string::npos);
  expect_refused("identify demo.csv --color sometimes", {"--color", "sometimes", "auto, always, never"});
  if (!has("script")) GTEST_SKIP() << "no script(1): no terminal to show colours on";
  const auto coloured = [&](const std::string& text) { return text.find(colour) != std::string::npos; };
  EXPECT_TRUE(coloured(on_terminal("identify demo.csv --brief")));
  EXPECT_FALSE(coloured(on_terminal("identify demo.csv --brief", "NO_COLOR=1")));
  EXPECT_TRUE(coloured(on_terminal("identify demo.csv --brief", "NO_COLOR=")));  // as no-color.org has it
  EXPECT_TRUE(coloured(on_terminal("identify demo.csv --brief --color always", "NO_COLOR=1")));
  EXPECT_FALSE(coloured(on_terminal("identify demo.csv --brief --color never")));
  EXPECT_FALSE(coloured(on_terminal("identify demo.csv --brief", "TERM=dumb")));
}

TEST_F(GeneralOptions, ProgressIsALineThatGoesAway) {
  if (!has("script")) GTEST_SKIP() << "no script(1): no terminal to show progress on";
  simulate();
  const auto shown = on_terminal("identify demo.csv --bootstrap 200 --brief");
  EXPECT_NE(shown.find("\rresonid: 1."), std::string::npos) << shown;
  EXPECT_NE(shown.find("bootstrap"), std::string::npos) << shown;
  const auto clear = shown.rfind("\r\x1b[K");
  ASSERT_NE(clear, std::string::npos) << shown;
  EXPECT_LT(clear, shown.find("Trusted")) << shown;
}

TEST_F(GeneralOptions, AnInterruptLeavesNothingBehind) {
  simulate();
  for (const auto& [signal, code, word] :
       {std::tuple{"INT", 130, "resonid: interrupted\n"}, std::tuple{"TERM", 143, "resonid: terminated\n"}}) {
    const auto done = shell(std::string("timeout --preserve-status -s ") + signal +
                            " 0.7 '" RESONID_PROGRAM
                            "' identify demo.csv --bootstrap 100000 --json result.json --report page.html");
    EXPECT_EQ(done.exit_code, code);
    EXPECT_EQ(done.out, "");
    EXPECT_EQ(done.error, word);
    for (const auto& entry : std::filesystem::directory_iterator(path("")))
      EXPECT_TRUE(entry.path().filename() == "demo.csv" || entry.path().filename() == "stderr.txt")
          << entry.path();
  }
}

}  // namespace
}  // namespace resonid
