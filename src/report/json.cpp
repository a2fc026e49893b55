// SPDX-License-Identifier: MIT
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/report/json.hpp>

#include "report/result_lists.hpp"
#include "report/words.hpp"

namespace resonid::report {
namespace {

using identification::Result;
using nlohmann::json;

json curve(const data::FrequencyResponse& g) {
  json c{{"frequency_hz", g.frequency_hz}, {"real", json::array()}, {"imag", json::array()}};
  for (const auto& value : g.value) {
    c["real"].push_back(value.real());
    c["imag"].push_back(value.imag());
  }
  if (!g.std.empty()) c["std"] = g.std;
  if (!g.coherence.empty()) c["coherence"] = g.coherence;
  if (!g.unsettled_hz.empty()) c["unsettled_hz"] = g.unsettled_hz;
  return c;
}

json estimate(const data::Estimate& e, const std::string& unit) {
  json j{{"value", e.value}, {"unit", unit}};
  if (std::isfinite(e.std)) j["std"] = e.std;
  return j;
}

/// Of the estimated parameters; nothing where one is not known at all.
json covariance_json(const fit::DriveModel& drive) {
  json names = json::array(), matrix = json::array();
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (!drive.estimated[static_cast<std::size_t>(i)]) continue;
    names.push_back(fit::kParameterNames[static_cast<std::size_t>(i)]);
    json row = json::array();
    for (int j = 0; j < fit::kParameterCount; ++j) {
      if (!drive.estimated[static_cast<std::size_t>(j)]) continue;
      if (!std::isfinite(drive.covariance(i, j))) return {};
      row.push_back(drive.covariance(i, j));
    }
    matrix.push_back(std::move(row));
  }
  if (names.empty()) return {};
  return {{"parameters", std::move(names)}, {"matrix", std::move(matrix)}};
}

json model_json(const identification::ModelResult& model, const identification::Units& units,
                const std::optional<double>& radius_m) {
  const auto& drive = model.drive;
  const bool flexible = drive.structure != fit::Structure::rigid;
  json parameters;
  const auto put = [&](fit::Parameter p, const std::string& unit) {
    parameters[std::string(fit::kParameterNames[static_cast<std::size_t>(p)])] =
        estimate(drive.estimate(p), unit);
  };
  put(fit::kDrivenInertia, units.inertia);
  if (flexible) {
    put(fit::kLoadInertia, units.inertia);
    put(fit::kStiffness, units.stiffness);
    put(fit::kDamping, units.damping);
    if (drive.structure == fit::Structure::three_mass) {
      put(fit::kMiddleInertia, units.inertia);
      put(fit::kStiffness2, units.stiffness);
      put(fit::kDamping2, units.damping);
    }
    put(fit::kDelay, "s");
    if (radius_m) {
      const double square = *radius_m * *radius_m;
      const auto at_the_belt = [&](fit::Parameter p) {
        const auto e = drive.estimate(p);
        return data::Estimate{e.value / square, e.std / square};
      };
      parameters["belt_stiffness"] = estimate(at_the_belt(fit::kStiffness), "N/m");
      parameters["belt_damping"] = estimate(at_the_belt(fit::kDamping), "Ns/m");
      if (drive.structure == fit::Structure::three_mass) {
        parameters["belt_stiffness_2"] = estimate(at_the_belt(fit::kStiffness2), "N/m");
        parameters["belt_damping_2"] = estimate(at_the_belt(fit::kDamping2), "Ns/m");
      }
    }
  } else if (drive.estimated[fit::kDelay]) {
    put(fit::kDelay, "s");
  }
  if (drive.estimated[fit::kViscousFriction] || !flexible) put(fit::kViscousFriction, units.damping);
  if (model.coulomb_friction)
    parameters["coulomb_friction"] = estimate(*model.coulomb_friction, units.torque);
  if (model.offset) parameters["offset"] = estimate(*model.offset, units.torque);
  const auto g = drive.transfer_function();
  json j{{"structure", std::string(fit::name_of(drive.structure))},
         {"fitted_to", model.from_record ? "record" : "response"},
         {"model_error", model.model_error},
         {"parameters", parameters},
         {"transfer_function",
          {{"numerator", g.numerator}, {"denominator", g.denominator}, {"sample_time_s", g.sample_time_s}}}};
  if (auto covariance = covariance_json(drive); !covariance.is_null())
    j["covariance"] = std::move(covariance);
  return j;
}

json loop_json(const identification::LoopResult& loop) {
  const auto& m = loop.margins;
  json j{{"source", loop.source},
         {"modulus_margin", m.modulus_margin},
         {"modulus_margin_hz", m.modulus_margin_hz}};
  const auto put = [&](const char* key, const std::optional<double>& value) {
    if (value && std::isfinite(*value)) j[key] = *value;
  };
  put("crossover_hz", m.crossover_hz());
  put("phase_margin_deg", m.phase_margin_deg());
  put("worst_phase_margin_deg", m.worst_phase_margin_deg);
  put("gain_margin_db", m.gain_margin_db);
  put("gain_margin_hz", m.gain_margin_hz);
  put("crossover_std_hz", loop.crossover_std_hz);
  put("phase_margin_std_deg", loop.phase_margin_std_deg);
  put("modulus_margin_std", loop.modulus_margin_std);
  put("gain_margin_std_db", loop.gain_margin_std_db);
  if (m.crossovers.size() > 1) {
    j["crossovers"] = json::array();
    for (const auto& c : m.crossovers)
      j["crossovers"].push_back({{"frequency_hz", c.frequency_hz}, {"phase_margin_deg", c.phase_margin_deg}});
  }
  return j;
}

}  // namespace

json record_json(const identification::RecordFacts& record) {
  json signals;
  const auto put = [&](const char* role, const std::string& name) {
    if (!name.empty()) signals[role] = name;
  };
  put("time", record.time);
  put("input", record.input);
  put("output", record.output);
  put("excitation", record.excitation);
  put("reference", record.reference);
  constexpr const char* kQuantities[] = {"velocity", "position", "acceleration"};
  return {{"file", record.file},
          {"samples", record.samples},
          {"sample_rate_hz", record.sample_rate_hz},
          {"output_quantity", kQuantities[static_cast<int>(record.output_quantity)]},
          {"signals", signals}};
}

json findings_json(const std::vector<diagnostics::Finding>& findings) {
  constexpr const char* kSeverities[] = {"info", "warning", "error"};
  json list = json::array();
  for (const auto& f : findings) {
    json j{{"id", f.id}, {"severity", kSeverities[static_cast<int>(f.severity)]}, {"meaning", f.meaning}};
    if (f.value && std::isfinite(*f.value)) j["value"] = *f.value;
    if (f.threshold && std::isfinite(*f.threshold)) j["threshold"] = *f.threshold;
    list.push_back(std::move(j));
  }
  return list;
}

json to_json(const Result& result) {
  json j{{"schema", "resonid.identification/1"},
         {"record", record_json(result.record)},
         {"method", result.method},
         {"approach", result.approach},
         {"confidence", result.confidence},
         {"units",
          {{"input", result.units.input},
           {"velocity", result.units.velocity},
           {"response", result.units.response}}},
         {"frequency_response", curve(result.response)},
         {"resonances", json::array()},
         {"trusted", result.trusted},
         {"findings", findings_json(result.findings)}};
  if (result.known_delay_s > 0.0) j["known_delay_s"] = result.known_delay_s;
  if (result.radius_m) j["radius_m"] = *result.radius_m;
  if (result.distortion) j["distortion"] = distortion_json(*result.distortion);
  for (const auto& r : result.modes) {
    json entry{{"kind", r.anti ? "antiresonance" : "resonance"},
               {"frequency_hz", r.frequency_hz.value},
               {"source", r.from_model ? "model" : "response"}};
    if (std::isfinite(r.frequency_hz.std)) entry["std_hz"] = r.frequency_hz.std;
    if (std::isfinite(r.damping_ratio.value)) entry["damping_ratio"] = r.damping_ratio.value;
    if (std::isfinite(r.damping_ratio.std)) entry["damping_ratio_std"] = r.damping_ratio.std;
    j["resonances"].push_back(std::move(entry));
  }
  if (result.model) j["model"] = model_json(*result.model, result.units, result.radius_m);
  if (result.black_box && !result.model) j["model"] = black_box_json(*result.black_box);
  if (result.loop) j["loop"] = loop_json(*result.loop);
  if (result.validation) {
    const auto& v = *result.validation;
    j["validation"] = {{"fit_percent", v.fit_percent}, {"of", v.of_record ? "record" : "lines"}};
    if (v.cross_correlation_max) j["validation"]["cross_correlation_max"] = *v.cross_correlation_max;
    if (v.limit) j["validation"]["limit"] = *v.limit;
    if (v.residual_rms) j["validation"]["residual_rms"] = *v.residual_rms;
  }
  if (result.independent) {
    const auto& v = *result.independent;
    j["cross_validation"] = {{"file", v.file},
                             {"approach", v.approach},
                             {"simulation_fit_percent", v.simulation_fit_percent},
                             {"prediction_fit_percent", v.prediction_fit_percent},
                             {"verdict", v.verdict}};
    if (v.response_error) j["cross_validation"]["response_error"] = *v.response_error;
  }
  put_lists(result, j);
  return j;
}

}  // namespace resonid::report
