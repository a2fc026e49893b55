// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/report/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What a validation comes to, in plain sentences.
[[nodiscard]] std::vector<std::string> sentences(const identification::ModelValidation& validation);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::ModelValidation& validation);

/// The object of `validate --json`:
///
///     {schema: "resonid.validation/1", model, record, approach, verdict: "accepted"|"doubtful"|"rejected",
///      trusted, simulation_fit_percent, prediction_fit_percent, offset: {value, std, unit}, known_delay_s,
///      residual: {samples, mean, rms, snr_db, unit, limit, practical_limit, judged_lags, lags: [],
///                 autocorrelation: [], simulated|input|excitation: {correlation: [], largest, largest_lag,
///                 beyond_limit, colour},
///                 bands: [{low_hz, high_hz, output_share, residual_share, left}],
///                 dependence: {on, lags, probability, share},
///                 static: [{over, level: [], mean: [], std: [], unit, probability, share}]},
///      fit_in_band: {low_hz, high_hz, fit_percent}, expected_fit_percent,
///      response: {error, error_at_least, frequency_hz: [], distance: [], std: [], largest, largest_hz,
///                 worst_line_hz, worst_line_error, probability}, findings}
///
/// What is not there is absent.
[[nodiscard]] nlohmann::json to_json(const identification::ModelValidation& validation);

/// The page of `validate --report`: record and simulation, residual, its correlations, the responses.
[[nodiscard]] Document document(const identification::ModelValidation& validation,
                                const data::Record& record);

/// The model of a file: a result of `identify --json`, or a bare transfer function `{"numerator": [],
/// "denominator": [], "sample_time_s": T}` in powers of z^-1.
[[nodiscard]] expected<identification::CandidateModel, JsonError> candidate_from_json(
    const nlohmann::json& json);

}  // namespace resonid::report
