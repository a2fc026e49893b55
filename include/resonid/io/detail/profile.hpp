// SPDX-License-Identifier: MIT
#pragma once

#include <filesystem>
#include <resonid/base/expected.hpp>
#include <string>
#include <vector>

namespace resonid::io {

/// One key of a profile: a TOML file of defaults for the options of the command line, with keys for all verbs
/// and a table for each verb.
struct ProfileEntry {
  std::string table;                ///< "identify", "excite.chirp"; empty: for all verbs.
  std::string key;                  ///< Empty: the table itself, which is there.
  std::vector<std::string> values;  ///< As an option would have it: one, or those of a list.
  bool is_list = false, is_boolean = false;
  std::string where;  ///< "resonid.toml:3:1"
};

/// In the order of the file. Refused: what is no TOML, and values that are neither text, number, true, false
/// nor a list of texts and numbers.
[[nodiscard]] expected<std::vector<ProfileEntry>> read_profile(const std::filesystem::path& path);

/// "a \"quoted\" text" as TOML has it.
[[nodiscard]] std::string toml_text(const std::string& text);

}  // namespace resonid::io
