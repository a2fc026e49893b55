// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/finding.hpp>
#include <string>
#include <vector>

namespace resonid::cli {

/// --brief: the verdict, the key figures as sentences, and what speaks against them.
[[nodiscard]] std::string brief_text(const std::string& verdict, const std::vector<std::string>& sentences,
                                     const std::vector<diagnostics::Finding>& findings = {});
/// "Trusted."
[[nodiscard]] std::string trusted_text(bool trusted);

}  // namespace resonid::cli
