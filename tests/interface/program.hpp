// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace resonid::test {

inline std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

/// Tests that run the built program in a folder of their own, which is removed afterwards.
class ProgramTest : public ::testing::Test {
 protected:
  struct Outcome {
    int exit_code;
    std::string out;
    std::string error;
  };

  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              (std::string("resonid-") + test->name() + "-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::filesystem::path path(const std::string& name) const { return folder_ / name; }
  [[nodiscard]] std::string text(const std::string& name) const { return text_of(path(name)); }
  void write(const std::string& name, const std::string& contents) const {
    std::ofstream(path(name)) << contents;
  }

  /// `arguments` as a shell reads them; the program runs in the test's folder.
  [[nodiscard]] Outcome run(const std::string& arguments) const {
    return shell("'" RESONID_PROGRAM "' " + arguments);
  }

  /// Any other command, in the test's folder and in a locale that is not UTF-8.
  [[nodiscard]] Outcome shell(const std::string& words) const {
    const std::string command =
        "cd '" + folder_.string() + "' && export LC_ALL=C && { " + words + "; } 2> stderr.txt";
    Outcome outcome{-1, {}, {}};
    std::FILE* pipe = ::popen(command.c_str(), "r");
    if (pipe == nullptr) return outcome;
    for (int c = std::fgetc(pipe); c != EOF; c = std::fgetc(pipe)) outcome.out += static_cast<char>(c);
    const int status = ::pclose(pipe);
    outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    outcome.error = text("stderr.txt");
    return outcome;
  }

  /// Whether there is a program of that name.
  [[nodiscard]] bool has(const std::string& program) const {
    return shell("command -v " + program).exit_code == 0;
  }

  /// Wrong use: exit code 2, nothing on standard output, and all of `words` in the message.
  void expect_refused(const std::string& arguments, std::initializer_list<const char*> words) const {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_EQ(outcome.out, "") << arguments;
    for (const char* word : words)
      EXPECT_NE(outcome.error.find(word), std::string::npos) << arguments << "\nlacks: " << word << "\n"
                                                             << outcome.error;
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace resonid::test
