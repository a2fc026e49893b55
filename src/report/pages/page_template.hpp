// SPDX-License-Identifier: MIT
#pragma once

#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace resonid::report {

/// The page with its style and scripts; still open: {{title}}, {{content}} and {{data}}. What `data` is
/// decides what is drawn: a list is the charts of a document, an object an identification's result. Generated
/// from web/ at build time.
[[nodiscard]] std::string_view page_template() noexcept;

/// A place of a template and what stands there.
using Filling = std::pair<std::string_view, std::string_view>;

/// The template with its places filled, in one pass: what is filled in is never looked at again, whatever it
/// holds.
[[nodiscard]] std::string fill(std::string_view page, std::initializer_list<Filling> fillings);

/// The text with bytes that are not UTF-8 replaced.
[[nodiscard]] std::string repaired(const std::string& text);

}  // namespace resonid::report
