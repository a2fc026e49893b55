// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>
#include <resonid/report/json.hpp>

#include "report/json/files.hpp"
#include "report/json/results.hpp"

namespace resonid::report {
namespace {

using identification::CandidateModel;
using identification::Result;
using nlohmann::json;

template <class T>
json written(const T& result) {
  // Descriptions serve writing and reading; the writer changes nothing.
  return write([&](Fields& f) { describe(f, const_cast<T&>(result)); });
}

template <class T>
expected<T> read_as(const json& j) {
  T result;
  auto done = read(j, [&](Fields& f) { describe(f, result); });
  if (!done) return unexpected(std::move(done.error()));
  return result;
}

void describe_bare(Fields& f, data::TransferFunction& g) {
  describe(f, g);
  f.require(!g.numerator.empty(), "numerator", "at least one number");
  f.require(!g.denominator.empty() && g.denominator.front() != 0.0, "denominator",
            "numbers of which the first is not 0");
}

}  // namespace

json to_json(const Result& result) { return written(result); }
json to_json(const BatchResult& result) { return written(result); }
json to_json(const identification::Track& track) { return written(track); }
json to_json(const identification::ModelValidation& validation) { return written(validation); }
json to_json(const identification::Changes& changes) { return written(changes); }
json to_json(const FileInspection& inspection) { return written(inspection); }
json to_json(const planning::Plan& plan) { return written(plan); }
json to_json(const identification::Tuning& tuning) { return written(tuning); }
json to_json(const SimulatedTruth& truth) { return written(truth); }

template <>
expected<Result> from_json(const json& j) {
  Result result;
  auto done = read(j, [&](Fields& f) {
    if (!f.says("schema", "resonid.identifications/1")) {
      f.schema({"resonid.identification/1", "resonid.identifications/1"});
      return describe(f, result);
    }
    const bool joint = f.object({"joint", ""}, true, [&] { f({"result", ""}, result); });
    f.require(joint, "joint", "one estimate of all recordings, as join() makes it");
  });
  if (!done) return unexpected(std::move(done.error()));
  return result;
}
template <>
expected<BatchResult> from_json(const json& j) {
  return read_as<BatchResult>(j);
}
template <>
expected<FileInspection> from_json(const json& j) {
  return read_as<FileInspection>(j);
}
template <>
expected<identification::Track> from_json(const json& j) {
  return read_as<identification::Track>(j);
}
template <>
expected<identification::ModelValidation> from_json(const json& j) {
  return read_as<identification::ModelValidation>(j);
}
template <>
expected<identification::Changes> from_json(const json& j) {
  return read_as<identification::Changes>(j);
}
template <>
expected<planning::Plan> from_json(const json& j) {
  return read_as<planning::Plan>(j);
}
template <>
expected<identification::Tuning> from_json(const json& j) {
  return read_as<identification::Tuning>(j);
}
template <>
expected<SimulatedTruth> from_json(const json& j) {
  return read_as<SimulatedTruth>(j);
}

template <>
expected<CandidateModel> from_json(const json& j) {
  if (j.is_object() && (j.contains("numerator") || j.contains("denominator")) && !j.contains("schema")) {
    data::TransferFunction g;
    auto done = read(j, [&](Fields& f) { describe_bare(f, g); });
    if (!done) return unexpected(std::move(done.error()));
    const double first = g.denominator[0];
    for (auto* side : {&g.numerator, &g.denominator})
      for (double& c : *side) c /= first;
    CandidateModel candidate;
    candidate.transfer_function = std::move(g);
    return candidate;
  }
  auto result = from_json<Result>(j);
  if (!result) return unexpected(std::move(result.error()));
  if (!result->model && !result->black_box)
    return refuse("$.model", "found nothing, required a model, or a transfer function");
  return identification::candidate_of(*result);
}

std::vector<std::string> result_kinds() {
  std::vector<std::string> kinds;
  for (const auto& file : result_files()) kinds.push_back(file.name);
  return kinds;
}

}  // namespace resonid::report
