// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/compare.hpp>
#include <resonid/report/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What changed in plain sentences, what is significant first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Changes& comparison);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Changes& comparison);

/// The page of `compare --report`.
[[nodiscard]] Document document(const identification::Changes& comparison);

}  // namespace resonid::report
