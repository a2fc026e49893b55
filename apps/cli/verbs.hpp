// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

// One function per verb, in the order of the pipeline; each in a file of its name.
void add_excite(CLI::App& app);
void add_simulate(CLI::App& app);
void add_inspect(CLI::App& app);
void add_identify(CLI::App& app);
void add_track(CLI::App& app);
void add_validate(CLI::App& app);
void add_compare(CLI::App& app);
void add_tune(CLI::App& app);
void add_plan(CLI::App& app);
void add_monitor(CLI::App& app);
void add_demo(CLI::App& app);
void add_reproduce(CLI::App& app);  ///< Lists it; run_reproduce() does it.
void add_help(CLI::App& app);       ///< Lists it; run_help() does it.

/// `reproduce` by the program resonid-reproduce, in place of this one.
int run_reproduce(const std::vector<std::string>& arguments);
/// `help` for the verbs of `app`, whose names are its arguments.
int run_help(const CLI::App& app, const std::vector<std::string>& arguments);

}  // namespace resonid::cli
