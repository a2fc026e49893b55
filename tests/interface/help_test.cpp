// SPDX-License-Identifier: MIT
#include <algorithm>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "program.hpp"

namespace resonid {
namespace {

constexpr const char* kVerbs[] = {
    "excite",   "excite prbs", "excite multisine", "excite chirp", "excite stepped-sine",
    "simulate", "plan",        "inspect",          "identify",     "track",
    "validate", "compare",     "reproduce",        "help"};

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// The options that a help lists, each in a line that begins with it.
std::set<std::string> options_in(const std::string& help) {
  std::set<std::string> names;
  const std::regex form("^  (-[a-zA-Z])?(?:, )?(--[a-z0-9-]+)?( .*)?$");
  for (const auto& line : lines_of(help)) {
    std::smatch match;
    if (!line.starts_with("  -") || !std::regex_match(line, match, form)) continue;
    for (const int part : {1, 2})
      if (match[part].matched) names.insert(match[part]);
  }
  return names;
}

class Help : public test::ProgramTest {
 protected:
  /// What bash offers after these words.
  [[nodiscard]] std::set<std::string> completed(const std::string& words) const {
    write("complete.sh",
          "source completion.bash\nCOMP_WORDS=(" + words +
              ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_resonid\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n");
    const auto lines = lines_of(run("help --completion bash > completion.bash; bash complete.sh").out);
    return {lines.begin(), lines.end()};
  }
};

TEST_F(Help, HasAShortAndALongForm) {
  for (const std::string verb : kVerbs) {
    if (verb == "reproduce") continue;  // a program of its own
    const auto brief = run(verb + " -h"), whole = run(verb + " --help");
    EXPECT_EQ(brief.exit_code, 0) << verb;
    EXPECT_EQ(whole.exit_code, 0) << verb;
    EXPECT_LT(lines_of(brief.out).size(), 45U) << verb;
    EXPECT_LT(brief.out.size(), whole.out.size()) << verb;
    for (const char* part : {"Usage: resonid", "General:", "Exit codes:\n  0 ", "\n  2 ", "\n  130 "})
      EXPECT_NE(whole.out.find(part), std::string::npos) << verb << part;
    for (const auto& option : options_in(whole.out))
      EXPECT_NE(brief.out.find(option), std::string::npos) << verb << " -h lacks " << option;
  }
  EXPECT_NE(run("identify --help").out.find("\n  3 "), std::string::npos);
  EXPECT_EQ(run("simulate --help").out.find("\n  3 "), std::string::npos);
  EXPECT_EQ(run("-V").out, run("--version").out);
}

TEST_F(Help, IsAVerb) {
  EXPECT_EQ(run("help").out, run("--help").out);
  EXPECT_EQ(run("help identify").out, run("identify --help").out);
  EXPECT_EQ(run("help excite chirp").out, run("excite chirp --help").out);
  const auto finding = run("help low-coherence").out;
  for (const char* word :
       {"low-coherence: Low coherence\n", "\nmeaning   ", "\ncause     ", "\ncure      ", "\ntrust "})
    EXPECT_NE(finding.find(word), std::string::npos) << finding;
  EXPECT_NE(run("help reproduce").out.find("vi"), std::string::npos);  // knows its experiments
  expect_refused("help identfy", {"identfy", "did you mean 'identify'"});
  expect_refused("help identify chirp", {"'chirp'", "'resonid identify'"});
  expect_refused("help --completion ksh", {"--completion", "ksh", "bash, zsh, fish"});
}

TEST_F(Help, IsWrappedToTheTerminal) {
  for (const std::string verb : {"help", "excite chirp", "plan", "identify"}) {
    for (const std::size_t columns : {40U, 90U, 200U}) {
      std::size_t longest = 0;
      for (const char* form : {" -h", " --help"})
        for (const auto& line : lines_of(
                 shell("COLUMNS=" + std::to_string(columns) + " '" RESONID_PROGRAM "' " + verb + form).out)) {
          longest = std::max(longest, line.size());
          // One word may be longer than a narrow terminal.
          const bool word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
          const bool form_alone = line.starts_with("  --");
          const bool command = line.ends_with(" \\") || line.starts_with("      --");
          if (!word && !(columns <= 60 && (form_alone || command))) {
            EXPECT_LE(line.size(), std::min<std::size_t>(columns, 100)) << verb << ": " << line;
          }
        }
      if (columns > 100 && verb == "identify") {
        EXPECT_GT(longest, 90U);
      }
    }
  }
}

TEST_F(Help, ExamplesCanBePasted) {
  const auto help = run("identify --help").out;
  // A line that goes on ends with a backslash, and no option is parted from its value.
  EXPECT_NE(help.find(" \\\n      --"), std::string::npos);
  EXPECT_FALSE(std::regex_search(help, std::regex("--[a-z-]+ \\\\\n      [^-]")));
}

TEST_F(Help, CompletesEveryVerbAndOption) {
  if (!has("bash")) GTEST_SKIP() << "no bash";
  const auto verbs = completed("resonid ''");
  for (const std::string verb : kVerbs) {
    if (verb.find(' ') == std::string::npos) {
      EXPECT_TRUE(verbs.contains(verb)) << verb;
    }
    const auto offered = completed("resonid " + verb + " -");
    EXPECT_EQ(offered, options_in(run(verb + " --help").out)) << verb;
  }
  EXPECT_EQ(completed("resonid excite ''"),
            (std::set<std::string>{"prbs", "multisine", "chirp", "stepped-sine"}));
  EXPECT_EQ(completed("resonid identify a.csv --color ''"),
            (std::set<std::string>{"auto", "always", "never"}));
  EXPECT_EQ(completed("resonid identify --motion = l"), (std::set<std::string>{"linear"}));
  EXPECT_TRUE(completed("resonid help ''").contains("track"));
  write("record.csv", "");
  EXPECT_TRUE(completed("resonid identify rec").contains("record.csv"));
}

TEST_F(Help, CompletesInOtherShells) {
  const auto zsh = run("help --completion zsh").out, fish = run("help --completion fish").out;
  for (const std::string verb : kVerbs) {
    const auto options = options_in(run(verb + " --help").out);
    const auto kind = verb.substr(verb.find(' ') + 1);
    EXPECT_NE(zsh.find("'" + kind + ":"), std::string::npos) << kind;
    EXPECT_NE(fish.find("-f -a " + kind + " "), std::string::npos) << kind;
    for (const auto& option : options) {
      EXPECT_NE(zsh.find("'" + option + "["), std::string::npos) << option;
      const auto name = option.starts_with("--") ? " -l " + option.substr(2) : " -s " + option.substr(1);
      const auto fish_lines = lines_of(fish);
      EXPECT_TRUE(std::any_of(fish_lines.begin(), fish_lines.end(),
                              [&](const std::string& line) {
                                return line.find("from " + kind + "'") != std::string::npos &&
                                       line.find(name + " ") != std::string::npos;
                              }))
          << verb << option;
    }
  }
  for (const std::string other : {"zsh", "fish"})
    if (has(other)) {
      EXPECT_EQ(run("help --completion " + other + " > script; " + other + " -n script").error, "");
    }
}

TEST_F(Help, WritesManPages) {
  ASSERT_EQ(run("help --install-files .").exit_code, 0);
  for (const char* file :
       {"share/bash-completion/completions/resonid", "share/zsh/vendor-completions/_resonid",
        "share/fish/vendor_completions.d/resonid.fish", "share/man/man1/resonid.1"})
    EXPECT_TRUE(std::filesystem::exists(path(file))) << file;
  const bool groff = has("groff");
  for (std::string verb : kVerbs) {
    const auto options = options_in(run(verb + " --help").out);
    std::replace(verb.begin(), verb.end(), ' ', '-');
    const std::string file = "share/man/man1/resonid-" + verb + ".1";
    std::string page = text(file);
    EXPECT_TRUE(page.starts_with(".TH RESONID\\-")) << verb;
    std::erase(page, '\\');
    for (const auto& option : options) EXPECT_NE(page.find(option), std::string::npos) << verb << option;
    if (groff) {
      EXPECT_EQ(shell("groff -man -ww -Tutf8 -z " + file).error, "") << verb;
    }
  }
  EXPECT_EQ(run("help --man identify").out, text("share/man/man1/resonid-identify.1"));
}

/// With RESONID_WRITE_DOCS in the environment the page is written instead.
TEST_F(Help, WritesThePageOfFindings) {
  const std::filesystem::path page = RESONID_DOCS_DIR "/findings.md";
  const auto written = run("help findings").out;
  if (std::getenv("RESONID_WRITE_DOCS") != nullptr) std::ofstream(page, std::ios::binary) << written;
  EXPECT_EQ(written, test::text_of(page)) << "write it by: resonid help findings > docs/findings.md";
}

}  // namespace
}  // namespace resonid
