// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/core.h>
#include <toml++/toml.h>

#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>

namespace resonid::io {

/// "file:line:column".
inline std::string position(std::string_view file, const toml::source_region& region) {
  return fmt::format("{}:{}:{}", file, region.begin.line, region.begin.column);
}

/// The error names source, line and column.
[[nodiscard]] expected<toml::table, Error> parse_toml(std::string_view text, std::string_view source);

/// The refusal of "table.key", as checks of configurations name fields, with its place in the file: at the
/// value, else at its table, else at the file.
[[nodiscard]] Error placed(const toml::table& file, std::string_view source, Error error);

}  // namespace resonid::io
