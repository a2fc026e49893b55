// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/base/expected.hpp>
#include <resonid/io/error.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::io {

[[nodiscard]] inline unexpected<Error> fail(std::string message) {
  return unexpected<Error>(Error{std::move(message)});
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
