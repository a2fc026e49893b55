// SPDX-License-Identifier: MIT
#pragma once

#include <toml++/toml.h>

#include <resonid/base/expected.hpp>
#include <string_view>

namespace resonid::io {

/// The error names source, line and column.
[[nodiscard]] expected<toml::table, Error> parse_toml(std::string_view text, std::string_view source);

}  // namespace resonid::io
