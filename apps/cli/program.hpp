// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <string>
#include <vector>

namespace resonid::cli {

/// What stands behind the name of the program.
[[nodiscard]] std::vector<std::string> arguments_of(int argc, char** argv);

/// Calls `run` with the arguments and returns its exit code, or that of what it throws: 0 done, 2 wrong usage
/// or input that cannot be read, 3 not trusted where that is required, 1 anything else, 130 interrupted.
/// Errors are told on standard error, help on standard output. `app` has its general options.
[[nodiscard]] int run_program(CLI::App& app, const std::vector<std::string>& arguments,
                              const std::function<int(const std::vector<std::string>&)>& run,
                              bool ends_on_signals = true);

/// Parses the arguments, which runs what they ask for.
void parse(CLI::App& app, const std::vector<std::string>& arguments);

}  // namespace resonid::cli
