// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

/// Gives the program and every verb but `help` --profile and --no-profile, which with_profile() reads.
void add_profile_options(CLI::App& app);

/// The arguments with what a profile says of their verb, put behind the verb: resonid.toml of the current
/// folder, or the file of --profile. Options that the arguments give are left out, and those that cannot
/// stand beside them. A key that no verb has is an InputError.
[[nodiscard]] std::vector<std::string> with_profile(const CLI::App& app, std::vector<std::string> arguments);

/// Whether the option's value is the profile's, and none that was asked for.
[[nodiscard]] bool is_from_profile(const CLI::Option& option);
/// The option has got its value from elsewhere.
void forget_profile_of(const CLI::Option& option);
/// " (resonid.toml:3:1)" behind a complaint about an option whose value is the profile's; otherwise nothing.
[[nodiscard]] std::string profile_place(const std::string& complaint);
/// "resonid: profile resonid.toml: input, output-scale" on standard error, once, if anything was taken.
void tell_profile();

}  // namespace resonid::cli
