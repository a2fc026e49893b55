// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <string_view>
#include <vector>

namespace resonid::io {

/// The finite number that the whole text is, white space around it allowed, or nothing.
[[nodiscard]] std::optional<double> parse_number(std::string_view text) noexcept;

/// Frequencies as options and files write them: `FIRST:LAST:STEP` (LAST included when the step meets it) or
/// `F,F,F`. At most 100 000. The message says what was found and what is required, not where.
[[nodiscard]] expected<std::vector<double>, Error> parse_lines(std::string_view text);

/// Exactly `count` numbers with colons between them, as in `LO:HI` or `F0:F1:SECONDS`; `form` is how the user
/// knows it.
[[nodiscard]] expected<std::vector<double>, Error> parse_colons(std::string_view text, std::size_t count,
                                                                std::string_view form);

}  // namespace resonid::io
