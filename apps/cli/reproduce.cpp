// SPDX-License-Identifier: MIT
#include <unistd.h>

#include <CLI/App.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <string>
#include <system_error>

#include "errors.hpp"
#include "output.hpp"
#include "verbs.hpp"

namespace resonid::cli {

void add_reproduce(CLI::App& app) {
  app.add_subcommand("reproduce", "Runs published experiments and sets both figures side by side");
}

int run_reproduce(int /*argc*/, char** argv) {
  std::error_code unknown;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", unknown);
  const std::string beside =
      (unknown ? std::filesystem::path() : self.parent_path() / "resonid-reproduce").string();
  if (!beside.empty()) ::execv(beside.c_str(), argv);
  ::execvp("resonid-reproduce", argv);
  print_error(
      "resonid: reproduce: the program 'resonid-reproduce' is required beside 'resonid' or on the PATH, "
      "found none (" +
      std::string(std::strerror(errno)) + "); the build target resonid_reproduce makes it\n");
  return kFailed;
}

}  // namespace resonid::cli
