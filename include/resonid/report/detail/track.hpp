// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/identification/track.hpp>
#include <resonid/report/document.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// The object of `track --json`. What was not computed is absent; a value that a row lacks is null.
///
///     {schema: "resonid.track/1", record, method, approach, reason, start, known_delay_s, confidence,
///      units: {input, velocity, response}, rows, trusted, findings,
///      trust: {excited, converged, physical, residual, all},        shares of the rows after the start
///      final: {NAME: {value, std, unit}},                            of the last row
///      range: {NAME: {least, greatest, mean}},                       over the trusted rows
///      over_time: {time_s, lag_s, position_m, trusted, residual_rms, NAME, NAME_std}}   at most `rows` of
///      them
[[nodiscard]] nlohmann::json track_json(const identification::Track& track, std::size_t rows = 2000);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string track_text(const identification::Track& track);

/// The page of `track --report`: what is tracked over time, or over position where the machine moves, with
/// bands; the loop's Nyquist curve along the record, and the trust in it.
[[nodiscard]] Document track_document(const identification::Track& track);

}  // namespace resonid::report
