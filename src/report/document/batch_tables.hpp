// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/report/detail/batch.hpp>
#include <string>

// Tables that terminal and page share.
namespace resonid::report {

/// "15.106 +- 0.031 Hz" of a figure; "-" where the record has none.
[[nodiscard]] std::string value_text(double value, const std::optional<double>& std, double z);

/// "antiresonance_hz" -> "antiresonance", with its unit behind a comma: "antiresonance, Hz".
[[nodiscard]] std::string heading(const identification::Spread& figure);

/// One row per record: file, figures that tell machines apart, fit, verdict.
[[nodiscard]] Table records_table(const BatchResult& result);
/// One row per figure: mean, scatter, chi-square, verdict.
[[nodiscard]] Table spread_table(const BatchResult& result);
/// One row per record of a joint estimate.
[[nodiscard]] Table consistency_table(const identification::Joint& joint);
/// One row per figure of a result.
[[nodiscard]] Table figures_table(const identification::Result& result);
[[nodiscard]] Table structures_table(const std::vector<identification::StructureTrial>& structures);
[[nodiscard]] Table choices_table(const std::vector<identification::Choice>& choices);

/// What the records come to, in plain sentences.
[[nodiscard]] std::vector<std::string> sentences(const BatchResult& result);

}  // namespace resonid::report
