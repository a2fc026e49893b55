// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::io {

/// `where` names the file and, where they apply, line (counted from 1) and column; `requirement` what was
/// found and what is required.
[[nodiscard]] inline unexpected<Error> fail(std::string where, std::string requirement) {
  return unexpected<Error>(Error{{}, std::move(requirement), std::nan(""), std::move(where)});
}
[[nodiscard]] inline unexpected<Error> fail(std::string requirement) {
  return unexpected<Error>(Error{{}, std::move(requirement)});
}

/// Text of a file as it may stand in a message: in quotes, without control characters, not longer than a
/// line.
[[nodiscard]] std::string in_quotes(std::string_view text);

[[nodiscard]] std::string lower(std::string_view text);

/// The name that differs least from what was written, or an empty string when none is near.
[[nodiscard]] std::string nearest(std::string_view wanted, const std::vector<std::string>& names);

/// "a, b, c"; long lists are cut and say so.
[[nodiscard]] std::string listed(const std::vector<std::string>& names);

}  // namespace resonid::io
