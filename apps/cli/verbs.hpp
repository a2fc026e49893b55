// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>

namespace resonid::cli {

// One function per verb, in the order of the pipeline; each in a file of its name.
void add_excite(CLI::App& app);
void add_simulate(CLI::App& app);
void add_inspect(CLI::App& app);
void add_identify(CLI::App& app);
void add_track(CLI::App& app);
void add_validate(CLI::App& app);
void add_compare(CLI::App& app);
void add_plan(CLI::App& app);
void add_reproduce(CLI::App& app);         ///< Lists it; run_reproduce() does it.
int run_reproduce(int argc, char** argv);  ///< By the program resonid-reproduce, in place of this one.

}  // namespace resonid::cli
