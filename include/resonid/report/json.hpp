// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/identification/result.hpp>
#include <string>
#include <vector>

namespace resonid::report {

/// The object of `identify --json`, schema "resonid.identification/1". What was not computed is absent.
[[nodiscard]] nlohmann::json to_json(const identification::Result& result);

/// A place in a JSON text that is not as required.
struct JsonProblem {
  std::string path;      ///< "$.model.parameters.stiffness.value"
  std::string found;     ///< As it stands there, cut to a line; "nothing".
  std::string required;  ///< "a number"
};

/// Why a JSON text holds no result: all that is wrong with it.
struct JsonError {
  std::vector<JsonProblem> problems;  ///< At least one, in the order of the schema.
  /// "PATH: found ..., required ..." for each, one a line.
  [[nodiscard]] std::string message() const;
};

/// The result that to_json() wrote; of a file of several records the joint one. Keys that the schema does not
/// name are passed over, absent optional ones stay absent. What JSON does not hold is empty: the residual,
/// the loop's curve, measured_loop. Results without "covariance" get one without correlations.
[[nodiscard]] expected<identification::Result, JsonError> result_from_json(const nlohmann::json& json);

/// to_json() with the key "page" beside it: curves, signals and sentences for page().
[[nodiscard]] nlohmann::json page_json(const identification::Result& result, const data::Record& record);

/// The result in a few plain sentences, most important first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Result& result);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Result& result);

}  // namespace resonid::report
