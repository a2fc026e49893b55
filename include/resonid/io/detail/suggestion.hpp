// SPDX-License-Identifier: MIT
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace resonid::io {

/// " (did you mean 'name'?)" for the name nearest to a mistyped word, or nothing when none is near. To be put
/// behind the sentence that says what was found.
[[nodiscard]] std::string suggestion(std::string_view wanted, const std::vector<std::string>& names);

}  // namespace resonid::io
