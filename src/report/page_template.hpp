// SPDX-License-Identifier: MIT
#pragma once

#include <string_view>

namespace resonid::report {

/// The page with its styles and scripts, and the places {{title}}, {{figures}} and {{data}} still open.
/// Generated from web/ at build time.
[[nodiscard]] std::string_view page_template() noexcept;

}  // namespace resonid::report
