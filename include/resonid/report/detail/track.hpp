// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/track.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string track_text(const identification::Track& track);

/// The page of `track --report`: what is tracked over time, or over position where the machine moves, with
/// bands; the loop's Nyquist curve along the record, and the trust in it.
[[nodiscard]] Document track_document(const identification::Track& track);
/// The same with the recording's input and output.
[[nodiscard]] Document track_document(const identification::Track& track, const data::Record& record);

}  // namespace resonid::report
