// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace resonid::cli {

/// docs/findings.md, in the words of the command line.
[[nodiscard]] std::string findings_page();

/// What a finding of this id means, comes from and is cured by; none for an unknown id.
[[nodiscard]] std::optional<std::string> finding_text(std::string_view id);

}  // namespace resonid::cli
