// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/error.hpp>
#include <string>
#include <string_view>

// The library names fields of its options, as a designated initialiser does: "give .delay_s". Users of the
// command line know options. What field is which option stands in one table here.
namespace resonid::cli {

/// `from_hz` -> `--from`, `drift_per_s` -> `--drift`: the option of a field, without its unit.
[[nodiscard]] std::string option_name(std::string_view field);
/// `from_hz` -> `HZ`.
[[nodiscard]] std::string option_unit(std::string_view field);

/// "give .delay_s" -> "give --delay", of all fields in the table.
[[nodiscard]] std::string in_options(std::string_view text);
/// "--delay: must be 0 s or more, found -1".
[[nodiscard]] std::string in_options(const Error& error);

}  // namespace resonid::cli
