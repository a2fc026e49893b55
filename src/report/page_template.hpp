// SPDX-License-Identifier: MIT
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace resonid::report {

/// The pages with their styles and scripts. Places still open: {{title}} and {{data}}, and {{figures}} in the
/// report's, {{content}} in the document's. Generated from web/ at build time.
[[nodiscard]] std::string_view page_template() noexcept;
[[nodiscard]] std::string_view document_template() noexcept;

/// A place of a template and what stands there.
using Filling = std::pair<std::string_view, std::string_view>;

/// The template with its places filled, in one pass: what is filled in is never looked at again, whatever it
/// holds.
[[nodiscard]] std::string fill(std::string_view page, std::initializer_list<Filling> fillings);

/// The text with bytes that are not UTF-8 replaced.
[[nodiscard]] std::string repaired(const std::string& text);

}  // namespace resonid::report
