// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/report/detail/validate.hpp>

#include "report/json_place.hpp"
#include "report/words.hpp"

namespace resonid::report {
namespace {

using diagnostics::ResidualCorrelation;
using diagnostics::ResidualTest;
using identification::ModelValidation;
using nlohmann::json;

constexpr std::array<const char*, 3> kVerdicts = {"accepted", "doubtful", "rejected"};

const char* verdict(const ModelValidation& v) { return kVerdicts[static_cast<std::size_t>(v.verdict)]; }

json correlation_json(const ResidualCorrelation& c) {
  return {{"correlation", c.value},
          {"largest", c.largest},
          {"largest_lag", c.largest_lag},
          {"beyond_limit", c.beyond},
          {"colour", c.colour}};
}

json residual_json(const ResidualTest& t, const std::string& unit) {
  json lags = json::array();
  const auto m = static_cast<int>(t.max_lag);
  for (int lag = -m; lag <= m; ++lag) lags.push_back(lag);
  json j{{"samples", t.samples},
         {"mean", t.mean},
         {"rms", t.rms},
         {"unit", unit},
         {"limit", t.limit},
         {"practical_limit", diagnostics::kPracticalCorrelation},
         {"judged_lags", t.judged_lags},
         {"lags", std::move(lags)},
         {"autocorrelation", t.self.value}};
  if (std::isfinite(t.snr_db)) j["snr_db"] = t.snr_db;
  if (!t.with_simulated.value.empty()) j["simulated"] = correlation_json(t.with_simulated);
  if (!t.with_input.value.empty()) j["input"] = correlation_json(t.with_input);
  if (!t.with_excitation.value.empty()) j["excitation"] = correlation_json(t.with_excitation);
  return j;
}

/// What is left: per band, of what drives the machine, of static functions.
void put_left(const ModelValidation& v, json& j) {
  auto& r = j["residual"];
  for (const auto& b : v.bands)
    r["bands"].push_back({{"low_hz", b.low_hz},
                          {"high_hz", b.high_hz},
                          {"output_share", b.output_share},
                          {"residual_share", b.residual_share},
                          {"left", b.left}});
  if (v.dependence.lags > 0)
    r["dependence"] = {{"on", v.dependence.on},
                       {"lags", v.dependence.lags},
                       {"probability", v.dependence.probability},
                       {"share", v.dependence.share}};
  for (const auto& m : v.maps)
    r["static"].push_back({{"over", m.over},
                           {"level", m.level},
                           {"mean", m.mean},
                           {"std", m.std},
                           {"unit", v.units.input},
                           {"probability", m.probability},
                           {"share", m.share}});
  if (v.fit_in_band_percent)
    j["fit_in_band"] = {{"low_hz", v.fit_band_hz->first},
                        {"high_hz", v.fit_band_hz->second},
                        {"fit_percent", *v.fit_in_band_percent}};
  if (v.expected_fit_percent) j["expected_fit_percent"] = *v.expected_fit_percent;
}

/// In which bands most of the residual lies, and whether the input explains any of it.
std::string left_sentence(const ModelValidation& v) {
  const auto most = std::max_element(v.bands.begin(), v.bands.end(), [](const auto& a, const auto& b) {
    return a.residual_share < b.residual_share;
  });
  std::string text;
  if (most != v.bands.end())
    text = fmt::format(
        "Of the residual's power {:.0f} % lies in {:.3g} ... {:.3g} Hz, where {:.2g} % of the output's is "
        "left. ",
        100.0 * most->residual_share, most->low_hz, most->high_hz, 100.0 * most->left);
  if (v.dependence.lags > 0)
    text += v.dependence.probability < 0.01
                ? fmt::format(
                      "The past of the {} explains {:.1f} % of the whitened residual beyond chance "
                      "(probability {:.1g}).",
                      v.dependence.on, 100.0 * v.dependence.share, v.dependence.probability)
                : fmt::format(
                      "It does not depend on the {} beyond chance and the model's own uncertainty "
                      "(probability {:.2g}).",
                      v.dependence.on, v.dependence.probability);
  return text;
}

std::string correlation_sentence(const ModelValidation& v) {
  const auto& t = v.residual_test;
  std::string text;
  const auto put = [&](const ResidualCorrelation& c, const char* with) {
    if (c.value.empty()) return;
    text += fmt::format("{}{:.3f} with the {}", text.empty() ? "" : ", ", c.largest, with);
  };
  put(t.with_simulated, "simulated output");
  put(t.with_input, "input");
  put(t.with_excitation, "excitation");
  return fmt::format(
      "Residual: {:.4g} {} rms, {:.1f} dB below the simulated output. Largest correlation over lags 1 ... "
      "{}: {} (limits {:.3f} per lag at 3 %, {:.2f} practical).",
      t.rms, v.units.velocity, t.snr_db, t.judged_lags, text, t.limit, diagnostics::kPracticalCorrelation);
}

}  // namespace

std::vector<std::string> sentences(const ModelValidation& v) {
  std::vector<std::string> list;
  list.push_back(fmt::format("{} on this record: {}.", v.candidate.source,
                             v.verdict == identification::Verdict::accepted ? "accepted"
                             : v.verdict == identification::Verdict::doubtful
                                 ? "doubtful, it misses something of the drive"
                                 : "rejected"));
  list.push_back(fmt::format(
      "Simulated from the {} alone it reproduces {:.1f} % of the output; one step ahead, past outputs "
      "known, {:.1f} %.",
      v.approach == "indirect" ? "excitation (closed-loop predictor)" : "input", v.simulation_fit_percent,
      v.prediction_fit_percent));
  if (v.fit_in_band_percent)
    list.push_back(fmt::format("Within {:g} ... {:g} Hz it reproduces {:.1f} %.", v.fit_band_hz->first,
                               v.fit_band_hz->second, *v.fit_in_band_percent));
  list.push_back(correlation_sentence(v));
  if (const auto left = left_sentence(v); !left.empty()) list.push_back(left);
  if (v.gap && !v.gap->distance.empty()) {
    const auto i = v.gap->largest();
    list.push_back(fmt::format(
        "Model and measured response differ by {:.1f} % beyond the noise (rms over the lines), by at "
        "most {:.3f} in chordal distance (at {:.4g} Hz; pointwise, no v-gap).",
        100.0 * v.response_error.value_or(0.0), v.gap->distance[i], v.gap->frequency_hz[i]));
  }
  if (v.offset && std::abs(v.offset->value) > 2.0 * v.offset->std)
    list.push_back(
        fmt::format("A constant torque of {} {} was estimated with the initial state; nothing else was.",
                    with_error(v.offset->value, 1.96 * v.offset->std), v.units.torque));
  return list;
}

std::string summary_text(const ModelValidation& v) {
  std::string text = fmt::format("{}: {} samples at {:g} Hz, {} approach\n\n", v.record.file,
                                 v.record.samples, v.record.sample_rate_hz, v.approach);
  for (const auto& s : sentences(v)) text += wrapped(s, "", "  ") + "\n";
  text += findings_text(v.findings);
  return text + fmt::format("\n{}{}.{}\n", static_cast<char>(std::toupper(verdict(v)[0])), verdict(v) + 1,
                            v.trusted ? "" : " NOT trusted: see the errors above.");
}

json to_json(const ModelValidation& v) {
  json j{{"schema", "resonid.validation/1"},
         {"model", v.candidate.source},
         {"record", record_json(v.record)},
         {"approach", v.approach},
         {"verdict", verdict(v)},
         {"trusted", v.trusted},
         {"simulation_fit_percent", v.simulation_fit_percent},
         {"prediction_fit_percent", v.prediction_fit_percent},
         {"residual", residual_json(v.residual_test, v.units.velocity)},
         {"findings", findings_json(v.findings)}};
  if (v.known_delay_s > 0.0) j["known_delay_s"] = v.known_delay_s;
  const auto put = [&](const char* key, const std::optional<data::Estimate>& e) {
    if (e) j[key] = {{"value", e->value}, {"std", e->std}, {"unit", v.units.torque}};
  };
  put_left(v, j);
  put("offset", v.offset);
  put("coulomb_friction", v.coulomb_friction);
  if (v.gap && !v.gap->distance.empty()) {
    json r{{"frequency_hz", v.gap->frequency_hz},
           {"distance", v.gap->distance},
           {"largest", v.gap->distance[v.gap->largest()]},
           {"largest_hz", v.gap->frequency_hz[v.gap->largest()]}};
    if (!v.gap->std.empty()) r["std"] = v.gap->std;
    if (v.response_error) r["error"] = *v.response_error;
    if (v.response_error_low) r["error_at_least"] = *v.response_error_low;
    if (v.response_probability) {
      r["probability"] = *v.response_probability;
      r["worst_line_hz"] = *v.worst_line_hz;
      r["worst_line_error"] = *v.worst_line_error;
    }
    j["response"] = std::move(r);
  }
  return j;
}

expected<identification::CandidateModel, JsonError> candidate_from_json(const json& j) {
  identification::CandidateModel candidate;
  if (j.is_object() && (j.contains("numerator") || j.contains("denominator")) && !j.contains("schema")) {
    JsonError error;
    const JsonPlace root(j, error.problems);
    data::TransferFunction g;
    g.numerator = root.at("numerator").numbers();
    g.denominator = root.at("denominator").numbers();
    g.sample_time_s = root.at("sample_time_s").positive();
    if (g.numerator.empty()) root.maybe("numerator").refuse("at least one number");
    if (g.denominator.empty() || g.denominator[0] == 0.0)
      root.maybe("denominator").refuse("numbers of which the first is not 0");
    if (!error.problems.empty()) return unexpected(std::move(error));
    const double first = g.denominator[0];
    for (auto* side : {&g.numerator, &g.denominator})
      for (double& c : *side) c /= first;
    candidate.transfer_function = std::move(g);
    return candidate;
  }
  auto result = result_from_json(j);
  if (!result) return unexpected(result.error());
  if (!result->model && !result->black_box)
    return unexpected(JsonError{{{"$.model", "nothing", "a model, or a transfer function"}}});
  return identification::candidate_of(*result);
}

}  // namespace resonid::report
