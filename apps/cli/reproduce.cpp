// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <CLI/App.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <string>
#include <system_error>

#include "errors.hpp"
#include "output.hpp"
#include "reproduce_options.hpp"
#include "verbs.hpp"

namespace resonid::cli {

void add_reproduce(CLI::App& app) {
  auto* verb =
      app.add_subcommand("reproduce", "Runs published experiments and sets both figures side by side");
  const auto o = std::make_shared<ReproduceOptions>();
  add_reproduce_options(*verb, *o);
  verb->callback([o] {});  // keeps what the options point to
}

int run_reproduce(const std::vector<std::string>& arguments) {
  std::string name = "reproduce";
  std::vector<std::string> words = arguments;
  std::vector<char*> argv = {name.data()};
  for (auto& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  std::error_code unknown;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const std::string beside =
      (unknown ? std::filesystem::path() : self.parent_path() / "resonid-reproduce").string();
  if (!beside.empty()) ::execv(beside.c_str(), argv.data());
  ::execvp("resonid-reproduce", argv.data());
  print_error(
      "resonid: reproduce: the program 'resonid-reproduce' is required beside 'resonid' or on the PATH, "
      "found none (" +
      std::string(std::strerror(errno)) + "); the build target resonid_reproduce makes it\n");
  return kFailed;
}

}  // namespace resonid::cli
