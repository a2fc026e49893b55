// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>

namespace resonid::cli {

/// Parses the command line, which runs what it asks for, and returns the exit code: 0 done, 2 wrong usage or
/// input that cannot be read, 3 not trusted where that is required, 1 anything else. Errors are told on
/// standard error. `needs_verb`: a command line without a verb is wrong usage.
[[nodiscard]] int run_program(CLI::App& app, int argc, char** argv, bool needs_verb);

}  // namespace resonid::cli
