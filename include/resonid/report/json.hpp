// SPDX-License-Identifier: MIT
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <resonid/base/expected.hpp>
#include <string>
#include <string_view>
#include <vector>

namespace resonid::data {
struct Record;
}
namespace resonid::identification {
struct CandidateModel;
struct Changes;
struct ModelValidation;
struct Result;
struct Track;
struct Tuning;
}  // namespace resonid::identification
namespace resonid::planning {
struct Plan;
}

// Result files: src/report/json says once what each holds, docs/results.md is its table.
namespace resonid::report {

struct BatchResult;
struct SimulatedTruth;

/// A result as its file has it. What was not computed is absent.
[[nodiscard]] nlohmann::json to_json(const identification::Result& result);
[[nodiscard]] nlohmann::json to_json(const BatchResult& result);
/// At most 2000 rows, evenly spread.
[[nodiscard]] nlohmann::json to_json(const identification::Track& track);
[[nodiscard]] nlohmann::json to_json(const identification::ModelValidation& validation);
[[nodiscard]] nlohmann::json to_json(const identification::Changes& changes);
[[nodiscard]] nlohmann::json to_json(const planning::Plan& plan);
[[nodiscard]] nlohmann::json to_json(const identification::Tuning& tuning);
[[nodiscard]] nlohmann::json to_json(const SimulatedTruth& truth);

/// What to_json() wrote of one of these types; a Result also of a file of several records, the joint one.
/// Keys that the description does not name are passed over, absent optional ones stay absent. What the file
/// does not hold is empty: residuals, the loop's curve, excitation samples. The error names every place that
/// is not as required: `field` is the path of the first, "$.model.parameters.stiffness.value".
template <class T>
[[nodiscard]] expected<T> from_json(const nlohmann::json& json);
template <>
expected<identification::Result> from_json(const nlohmann::json& json);
template <>
expected<BatchResult> from_json(const nlohmann::json& json);
template <>
expected<identification::Track> from_json(const nlohmann::json& json);
template <>
expected<identification::ModelValidation> from_json(const nlohmann::json& json);
template <>
expected<identification::Changes> from_json(const nlohmann::json& json);
template <>
expected<planning::Plan> from_json(const nlohmann::json& json);
template <>
expected<identification::Tuning> from_json(const nlohmann::json& json);
template <>
expected<SimulatedTruth> from_json(const nlohmann::json& json);
/// The model of a file: a result of identify(), or a bare transfer function `{"numerator": [], "denominator":
/// [], "sample_time_s": T}` in powers of z^-1.
template <>
expected<identification::CandidateModel> from_json(const nlohmann::json& json);

/// Kinds of result files: "identification", "identifications", "track", "validation", "comparison", "plan",
/// "tuning", "truth".
[[nodiscard]] std::vector<std::string> result_kinds();
/// JSON Schema (2020-12) of one of them.
[[nodiscard]] nlohmann::json json_schema(std::string_view kind);
/// docs/results.md: every key of every file with type, unit and meaning, as Markdown.
[[nodiscard]] std::string results_document();

/// to_json() with the key "page" beside it: curves, signals and sentences for page().
[[nodiscard]] nlohmann::json page_json(const identification::Result& result, const data::Record& record);

/// The result in a few plain sentences, most important first.
[[nodiscard]] std::vector<std::string> sentences(const identification::Result& result);

/// Readable summary for a terminal, lines of at most 100 characters.
[[nodiscard]] std::string summary_text(const identification::Result& result);

}  // namespace resonid::report
