// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "program.hpp"

namespace resonid {
namespace {

class Reproduce : public test::ProgramTest {};

TEST_F(Reproduce, HelpShowsAnExampleAndTheNames) {
  const auto help = run("reproduce --help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* part : {"Example:\n  resonid reproduce iv", "Publication IV", "--seeds", "--markdown"})
    EXPECT_NE(help.out.find(part), std::string::npos) << help.out;
  EXPECT_NE(run("--help").out.find("reproduce"), std::string::npos);
}

TEST_F(Reproduce, WritesPageMarkdownAndJson) {
  const auto done = run("reproduce iv --seeds 2 --report iv.html --markdown iv.md --json iv.json");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_EQ(done.error, "");  // no terminal, no progress
  EXPECT_NE(done.out.find("Page written to iv.html"), std::string::npos);
  EXPECT_NE(done.out.find("distance at 11.9 Hz"), std::string::npos);
  const std::string page = text("iv.html");
  EXPECT_NE(page.find("<code>resonid reproduce iv --seeds 2 --report iv.html</code>"), std::string::npos);
  EXPECT_EQ(page.find("http://"), std::string::npos);
  EXPECT_EQ(page.find("https://"), std::string::npos);
  const std::string markdown = text("iv.md");
  EXPECT_NE(markdown.find("    resonid reproduce iv --seeds 2 --markdown iv.md\n"), std::string::npos);
  EXPECT_NE(markdown.find("| quantity | published | reproduced | true | note |"), std::string::npos);
  const auto told = nlohmann::json::parse(text("iv.json"));
  EXPECT_EQ(told.at("schema"), "resonid.document/1");
  EXPECT_EQ(told.at("seeds"), 2);
  EXPECT_GE(told.at("sections").size(), 6U);
  EXPECT_GE(told.at("discrepancies").size(), 14U);
}

TEST_F(Reproduce, StandardOutputIsAlone) {
  const auto done = run("reproduce iv --seeds 2 --json -");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_EQ(nlohmann::json::parse(done.out).at("command"), "resonid reproduce iv --seeds 2 --json -");
}

TEST_F(Reproduce, PutsPagesIntoAFolder) {
  const auto done = run("reproduce iv --seeds 2 --out pages/new");
  ASSERT_EQ(done.exit_code, 0) << done.error;
  EXPECT_NE(text("pages/new/iv.html").find("</html>"), std::string::npos);
}

TEST_F(Reproduce, WrongUseNamesWhatWasFoundAndWhatIsKnown) {
  expect_refused("reproduce ix", {"NAME", "'ix'", "i, ii, iii, iv, v, vi", "did you mean 'i'"});
  expect_refused("reproduce publication", {"NAME", "'publication'", "iv, v, vi"});
  expect_refused("reproduce iv --seeds 1", {"--seeds", "found 1", ">= 2"});
  expect_refused("reproduce iv --seeds two", {"--seeds", "'two'", "a whole number >= 2"});
  expect_refused("reproduce --report x.html", {"--report", "a NAME", "iv, v, vi", "--out FOLDER"});
  expect_refused("reproduce iv --json - --markdown -", {"--markdown", "--json", "standard output"});
  expect_refused("reproduce iv --json a --markdown a", {"--json", "'a'", "a file of its own"});
  expect_refused("reproduce iv --json a --markdown ./a", {"--json", "a file of its own"});
  expect_refused("reproduce iv --seed 3", {"unknown option '--seed'", "did you mean '--seeds'"});
  EXPECT_FALSE(std::filesystem::exists(path("x.html")));
}

TEST_F(Reproduce, AFileThatCannotBeWrittenIsAFailure) {
  const auto failed = run("reproduce iv --seeds 2 --markdown missing/x.md");
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_NE(failed.error.find("missing"), std::string::npos);
  write("file", "");
  EXPECT_EQ(run("reproduce iv --seeds 2 --out file/below").exit_code, 1);
}

// A million seeds would take hours: what cannot be written is told before the first run.
TEST_F(Reproduce, APlaceThatCannotBeWrittenIsToldBeforeTheWork) {
  std::filesystem::create_directories(path("pages/iv.html"));
  for (const char* place : {"--report missing/x.html", "--markdown missing/x.md", "--json missing/x.json",
                            "--report pages", "--out pages"}) {
    const auto failed = run(std::string("reproduce iv --seeds 1000000 ") + place);
    EXPECT_EQ(failed.exit_code, 1) << place;
    EXPECT_NE(failed.error.find("cannot write"), std::string::npos) << failed.error;
    EXPECT_EQ(failed.out, "") << place;
  }
}

/// A text cut into numbers and what stands between them.
struct Pieces {
  std::vector<std::string> words, numbers;
};

Pieces cut(const std::string& text) {
  Pieces pieces{{""}, {}};
  for (std::size_t i = 0; i < text.size();) {
    if (std::isdigit(static_cast<unsigned char>(text[i])) != 0) {
      char* end = nullptr;
      std::strtod(text.c_str() + i, &end);
      const auto length = static_cast<std::size_t>(end - (text.c_str() + i));
      pieces.numbers.push_back(text.substr(i, length));
      pieces.words.emplace_back();
      i += length;
    } else {
      pieces.words.back() += text[i++];
    }
  }
  return pieces;
}

/// What the last printed digit is worth.
double last_digit(const std::string& number) {
  const std::size_t power = number.find('e');
  const std::string digits = number.substr(0, power);
  const std::size_t point = digits.find('.');
  const auto decimals = point == std::string::npos ? 0.0 : static_cast<double>(digits.size() - point - 1);
  return std::pow(10.0, -decimals) *
         (power == std::string::npos ? 1.0 : std::pow(10.0, std::atof(number.c_str() + power + 1)));
}

/// Equal up to three units in the last digit of either; figures below 1e-6 are rounding, whatever they are.
bool agree(const std::string& a, const std::string& b) {
  const double x = std::atof(a.c_str());
  const double y = std::atof(b.c_str());
  if (std::abs(x) < 1e-6 && std::abs(y) < 1e-6) return true;
  return std::abs(x - y) <= 3.0 * std::max(last_digit(a), last_digit(b));
}

/// From the first paragraph on: the command above it names the file that was written.
std::string without_command(const std::string& markdown) {
  const std::size_t command = markdown.find("\n    resonid reproduce ");
  return command == std::string::npos ? markdown : markdown.substr(markdown.find('\n', command + 1));
}

/// docs/validation/publication_NAME.md is what `resonid reproduce NAME --markdown FILE` writes today.
TEST_F(Reproduce, DocumentationIsUpToDate) {
  std::size_t compared = 0;
  for (const auto& file : std::filesystem::directory_iterator(RESONID_DOCS_DIR "/validation")) {
    const std::string stem = file.path().stem().string();
    if (stem.rfind("publication_", 0) != 0) continue;
    const std::string name = stem.substr(std::string("publication_").size());
    const auto done = run("reproduce " + name + " --markdown new.md");
    ASSERT_EQ(done.exit_code, 0) << done.error;
    const std::string again = "make it again with the command at its top: " + file.path().string();
    const auto old_pieces = cut(without_command(test::text_of(file.path())));
    const auto new_pieces = cut(without_command(text("new.md")));
    ASSERT_EQ(old_pieces.words, new_pieces.words) << again;
    for (std::size_t i = 0; i < old_pieces.numbers.size(); ++i)
      EXPECT_TRUE(agree(old_pieces.numbers[i], new_pieces.numbers[i]))
          << old_pieces.numbers[i] << " became " << new_pieces.numbers[i] << " after '" << old_pieces.words[i]
          << "'; " << again;
    ++compared;
  }
  EXPECT_GE(compared, 1U);
}

}  // namespace
}  // namespace resonid
