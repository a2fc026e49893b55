// SPDX-License-Identifier: MIT
#include "truth_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>

namespace resonid::cli {
namespace {

nlohmann::json parameter(double value, const char* unit) { return {{"value", value}, {"unit", unit}}; }

nlohmann::json coupling_json(const plant::Coupling& c, const char* stiffness, const char* damping) {
  return {{"between", {c.from, c.to}},
          {"stiffness", parameter(c.stiffness, stiffness)},
          {"damping", parameter(c.damping, damping)}};
}

/// Names of INTERFACES 1; a chain gives lists, from the driven side to the load.
nlohmann::json parameters_json(const plant::Truth& truth) {
  const bool rotary = truth.motion == data::Motion::rotary;
  const char* inertia = rotary ? "kgm2" : "kg";
  const char* stiffness = rotary ? "Nm/rad" : "N/m";
  const char* damping = rotary ? "Nms/rad" : "Ns/m";
  const char* torque = rotary ? "Nm" : "N";
  const auto& masses = truth.system.inertia;
  const auto& couplings = truth.system.couplings;
  nlohmann::json parameters{{"driven_inertia", parameter(masses.front(), inertia)}};
  if (masses.size() > 1) parameters["load_inertia"] = parameter(masses.back(), inertia);
  if (truth.structure == plant::Structure::chain) {
    for (const double mass : masses) parameters["inertias"].push_back(parameter(mass, inertia));
    parameters["couplings"] = nlohmann::json::array();
    for (const auto& c : couplings) parameters["couplings"].push_back(coupling_json(c, stiffness, damping));
  } else if (!couplings.empty()) {
    parameters["stiffness"] = parameter(couplings[0].stiffness, stiffness);
    parameters["damping"] = parameter(couplings[0].damping, damping);
  }
  if (truth.structure == plant::Structure::three_mass) {
    parameters["middle_inertia"] = parameter(masses[1], inertia);
    parameters["stiffness_2"] = parameter(couplings[1].stiffness, stiffness);
    parameters["damping_2"] = parameter(couplings[1].damping, damping);
    if (couplings[2].stiffness > 0.0) {
      parameters["bypass_stiffness"] = parameter(couplings[2].stiffness, stiffness);
      parameters["bypass_damping"] = parameter(couplings[2].damping, damping);
    }
  }
  if (masses.size() == 1 || truth.system.viscous.front() > 0.0)
    parameters["viscous_friction"] = parameter(truth.system.viscous.front(), damping);
  if (masses.size() > 1 && truth.system.viscous.back() > 0.0)
    parameters["load_viscous_friction"] = parameter(truth.system.viscous.back(), damping);
  if (truth.friction.any()) parameters["coulomb_friction"] = parameter(truth.friction.coulomb, torque);
  if (truth.load_friction.any())
    parameters["load_coulomb_friction"] = parameter(truth.load_friction.coulomb, torque);
  if (truth.torque_lag_s > 0.0) parameters["torque_lag"] = parameter(truth.torque_lag_s, "s");
  return parameters;
}

nlohmann::json transfer_function_json(const data::TransferFunction& g) {
  return {{"numerator", g.numerator}, {"denominator", g.denominator}, {"sample_time_s", g.sample_time_s}};
}

/// Whether the polynomials give the response: of high order at a fast rate their digits cancel.
bool is_accurate(const plant::Truth& truth) {
  constexpr double kMost = 1e-6;
  const auto& response = truth.response;
  for (std::size_t i = 0; i < response.value.size(); ++i) {
    const auto value = response.value[i];
    if (!(std::abs(truth.plant.response(response.frequency_hz[i]) - value) <= kMost * std::abs(value)))
      return false;
  }
  return true;
}

nlohmann::json resonances_json(const plant::Truth& truth) {
  nlohmann::json list = nlohmann::json::array();
  const auto add = [&](const std::vector<data::UndampedMode>& modes, const char* kind) {
    for (const auto& mode : modes)
      list.push_back({{"kind", kind},
                      {"frequency_hz", mode.frequency_hz},
                      {"damping_ratio", mode.damping_ratio},
                      {"source", "model"}});
  };
  add(truth.antiresonances, "antiresonance");
  add(truth.resonances, "resonance");
  std::sort(list.begin(), list.end(), [](const nlohmann::json& a, const nlohmann::json& b) {
    return a["frequency_hz"] < b["frequency_hz"];
  });
  return list;
}

nlohmann::json over_time_json(const plant::OverTime& over_time) {
  nlohmann::json result{{"time_s", over_time.time_s}, {"resonance_hz", over_time.resonance_hz}};
  if (!over_time.position_m.empty()) result["position_m"] = over_time.position_m;
  return result;
}

/// Margins of the real loop (METHOD 10.2).
nlohmann::json loop_json(const data::FrequencyResponse& loop) {
  const auto margins = diagnostics::loop_margins(loop);
  nlohmann::json result{{"modulus_margin", margins.modulus_margin}};
  if (const auto value = margins.crossover_hz()) result["crossover_hz"] = *value;
  if (const auto value = margins.phase_margin_deg()) result["phase_margin_deg"] = *value;
  auto gain_margin = margins.gain_margin_db;
  // At half the sample rate the loop is real: it may end at -180 degrees without crossing them.
  const std::complex<double> end = loop.value.back();
  if (end.real() < 0.0) {
    const double db = -20.0 * std::log10(-end.real());
    if (!gain_margin || db < *gain_margin) gain_margin = db;
  }
  if (gain_margin) result["gain_margin_db"] = *gain_margin;
  return result;
}

nlohmann::json response_json(const data::FrequencyResponse& response) {
  nlohmann::json re = nlohmann::json::array();
  nlohmann::json im = nlohmann::json::array();
  for (const auto& value : response.value) {
    re.push_back(value.real());
    im.push_back(value.imag());
  }
  return {{"frequency_hz", response.frequency_hz}, {"real", re}, {"imag", im}};
}

}  // namespace

nlohmann::json truth_json(const plant::Truth& truth) {
  nlohmann::json result{{"schema", "resonid.truth/1"},
                        {"seed", truth.seed},
                        {"delay_s", truth.delay_s},
                        {"frequency_response", response_json(truth.response)},
                        {"resonances", resonances_json(truth)}};
  // A tooth belt is a two-mass drive at every place.
  const auto structure =
      truth.structure == plant::Structure::tooth_belt ? plant::Structure::two_mass : truth.structure;
  result["model"] = {{"structure", plant::enum_names(structure)[static_cast<std::size_t>(structure)]},
                     {"parameters", parameters_json(truth)}};
  if (is_accurate(truth)) result["model"]["transfer_function"] = transfer_function_json(truth.plant);
  if (truth.over_time) result["over_time"] = over_time_json(*truth.over_time);
  if (truth.controller) {
    result["controller"] = transfer_function_json(*truth.controller);
    result["loop"] = loop_json(truth.loop);
  }
  return result;
}

}  // namespace resonid::cli
