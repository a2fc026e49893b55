// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/report/detail/document.hpp>
#include <string>
#include <string_view>

// Pieces of markup that a document's page is made of.
namespace resonid::report {

/// Escaped and typeset.
[[nodiscard]] std::string html(const std::string& text);
/// A number: escaped, with a typographic minus.
[[nodiscard]] std::string figure(const std::string& text);
[[nodiscard]] std::string element(std::string_view open, const std::string& content, std::string_view tag);

[[nodiscard]] std::string plain_table(const Table& table);
/// One row per recording, its interval as a bar over a scale that all rows share.
[[nodiscard]] std::string interval_table(const Intervals& list);
/// What the identification's page shows too: "Findings", sorted by severity.
[[nodiscard]] std::string findings_box(const std::vector<diagnostics::Finding>& findings);
/// Version, date, command line and the files' hashes, with lines to sign on paper.
[[nodiscard]] std::string provenance_box(const Provenance& provenance);

}  // namespace resonid::report
