// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/finding.hpp>
#include <resonid/report/detail/document.hpp>
#include <vector>

namespace resonid::report {

/// Findings as a section of a page.
[[nodiscard]] Section findings_section(const std::vector<diagnostics::Finding>& findings);

}  // namespace resonid::report
