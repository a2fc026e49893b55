// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/identification/compare.hpp>
#include <resonid/report/document.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What changed in plain sentences, what is significant first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Changes& comparison);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Changes& comparison);

/// The object of `compare --json`:
///
///     {schema: "resonid.comparison/1", first: {file, samples, sample_rate_hz}, second, confidence, changed,
///     trusted,
///      resonances: [difference], parameters: [difference], margins: [difference],
///      response_distance: {frequency_hz, distance, std, noise, largest, largest_hz, probability,
///      significant, weighted}, model_gap: {gap, std, largest_distance, frequency_hz,
///      winding_number_condition}, findings}
///     difference: {name, unit, first, first_std, second, second_std, change, std, relative, probability,
///     significant}
///
/// What is not known is absent.
[[nodiscard]] nlohmann::json to_json(const identification::Changes& comparison);

/// The page of `compare --report`.
[[nodiscard]] Document document(const identification::Changes& comparison);

}  // namespace resonid::report
