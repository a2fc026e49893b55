// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/expected.hpp>
#include <resonid/identification/validate.hpp>
#include <resonid/report/detail/document.hpp>
#include <resonid/report/json.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// What a validation comes to, in plain sentences.
[[nodiscard]] std::vector<std::string> sentences(const identification::ModelValidation& validation);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::ModelValidation& validation);

/// The page of `validate --report`: record and simulation, residual, its correlations, the responses.
[[nodiscard]] Document document(const identification::ModelValidation& validation,
                                const data::Record& record);

}  // namespace resonid::report
