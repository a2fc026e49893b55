// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// The object of `identify --json`, schema "resonid.identification/1". What was not computed is absent.
[[nodiscard]] nlohmann::json to_json(const identification::Result& result);

/// to_json() with the key "page" beside it: curves, signals and sentences for page().
[[nodiscard]] nlohmann::json page_json(const identification::Result& result, const data::Record& record);

/// The result in a few plain sentences, most important first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Result& result);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Result& result);

}  // namespace resonid::report
