// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/report/detail/provenance.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::cli {

/// A word of a command line: as it stands, or in single quotes where a shell would take it apart.
[[nodiscard]] std::string shell_word(std::string_view word);

/// Keeps the command line as a shell would read it again, argv[0] being the program that is named.
void remember_command(const std::string& program, int argc, const char* const* argv);

/// What the program was told and when ($SOURCE_DATE_EPOCH, else the clock), with the hashes of the files that
/// it read; empty names are left out.
[[nodiscard]] report::Provenance provenance_of_files(const std::vector<std::string>& files);

}  // namespace resonid::cli
