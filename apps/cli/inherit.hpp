// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <functional>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

/// What `identify` was told of recording, excitation, loop and model, by the command line or a profile: for
/// its results, so that other verbs need not be told again. A controller's file is there with what it holds.
[[nodiscard]] std::vector<identification::GivenOption> given_options(const CLI::App& verb);

/// Gives the verb what a result stores: columns, units, scales, controller, delay, radius; for the record
/// that the result is of, also the stretch used and what is known of its excitation. Options on the command
/// line overrule it, it overrules a profile. Says on standard error what was taken from `file`.
void inherit(CLI::App& verb, const std::vector<identification::GivenOption>& options, const std::string& file,
             bool same_record = false);

/// Of these options only those that are wanted, whatever they are of.
void inherit_wanted(CLI::App& verb, const std::vector<identification::GivenOption>& options,
                    const std::string& file, const std::function<bool(const CLI::Option&)>& wanted);

/// Whether a result is of this record, by the name of its file.
[[nodiscard]] bool is_of_record(const identification::Result& result, const std::string& record);

/// --save-profile: the same options, and the columns that were found, as a profile.
[[nodiscard]] std::string profile_text(const CLI::App& verb, const identification::RecordFacts& record);

}  // namespace resonid::cli
