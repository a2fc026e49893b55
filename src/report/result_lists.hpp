// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/identification/result.hpp>
#include <string>

#include "report/json_place.hpp"

// The lists of a result: what was chosen, what was tried, poles and zeros, intervals of the bootstrap.
namespace resonid::report {

/// Writes "choices", "structures", "poles", "zeros" and "bootstrap", where there are any.
void put_lists(const identification::Result& result, nlohmann::json& to);
/// Reads them back.
void read_lists(const JsonPlace& from, identification::Result& result);

/// The model without drive structure: {structure: "black-box", order, delay_samples, fit_percent,
/// delay (a further one): {value, std, unit}, transfer_function, covariance: {parameters: ["b1" ...],
/// matrix}}.
[[nodiscard]] nlohmann::json black_box_json(const identification::BlackBoxResult& black_box);
[[nodiscard]] identification::BlackBoxResult read_black_box(const JsonPlace& model);

/// {realisations, noise_std: [], distortion_std: [], scatter: {level, noise, lines, significant},
/// detection_lines: {even: {...}, odd: {...}}}, what is not known left out.
[[nodiscard]] nlohmann::json distortion_json(const identification::Distortion& distortion);
/// `lines`: of the response.
[[nodiscard]] identification::Distortion read_distortion(const JsonPlace& from, std::size_t lines);

/// The same lists for a terminal; empty without any.
[[nodiscard]] std::string choices_text(const identification::Result& result);
[[nodiscard]] std::string structures_text(const identification::Result& result);
[[nodiscard]] std::string bootstrap_text(const identification::Result& result);

}  // namespace resonid::report
