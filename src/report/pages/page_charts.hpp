// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>

// What the page of an identification draws beside its response and its loop; in the form of a document's
// charts.
namespace resonid::report {

/// Peaks of the sensitivity S = 1/(1+L) and of the complementary one T = L/(1+L) over the loop's curve. Ms is
/// the inverse of the modulus margin.
struct SensitivityPeaks {
  double ms = 0.0, ms_hz = 0.0;
  double mt = 0.0, mt_hz = 0.0;
};
[[nodiscard]] std::optional<SensitivityPeaks> sensitivity_peaks(const identification::Result& result);

/// Adds to `page` what there is of: `overlay` (output, measured and simulated), `sensitivity` (|S| and |T|),
/// `peaks`, `spectra` (input and output, excited lines marked), `inertia_ratio` {value, std}.
void put_charts(const identification::Result& result, const data::Record& record, nlohmann::json& page);

}  // namespace resonid::report
