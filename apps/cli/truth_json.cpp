// SPDX-License-Identifier: MIT
#include "truth_json.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/diagnostics/margins.hpp>

namespace resonid::cli {
namespace {

using nlohmann::json;

json parameter(double value, const char* unit) { return {{"value", value}, {"unit", unit}}; }

json parameters_json(const plant::Truth& truth) {
  const bool rotary = truth.motion == data::Motion::rotary;
  const char* inertia = rotary ? "kgm2" : "kg";
  const char* stiffness = rotary ? "Nm/rad" : "N/m";
  const char* damping = rotary ? "Nms/rad" : "Ns/m";
  json parameters;
  if (truth.two_mass) {
    parameters["driven_inertia"] = parameter(truth.two_mass->driven_inertia, inertia);
    parameters["load_inertia"] = parameter(truth.two_mass->load_inertia, inertia);
    parameters["stiffness"] = parameter(truth.two_mass->stiffness, stiffness);
    parameters["damping"] = parameter(truth.two_mass->damping, damping);
  } else {
    parameters["driven_inertia"] = parameter(truth.rigid_inertia, inertia);
  }
  if (!truth.two_mass || truth.viscous_friction > 0.0)
    parameters["viscous_friction"] = parameter(truth.viscous_friction, damping);
  return parameters;
}

json transfer_function_json(const data::TransferFunction& g) {
  return {{"numerator", g.numerator}, {"denominator", g.denominator}, {"sample_time_s", g.sample_time_s}};
}

json resonances_json(const plant::Truth& truth) {
  json list = json::array();
  if (!truth.two_mass) return list;
  const auto& p = *truth.two_mass;
  list.push_back({{"kind", "antiresonance"},
                  {"frequency_hz", data::antiresonance_hz(p)},
                  {"damping_ratio", data::antiresonance_damping_ratio(p)},
                  {"source", "model"}});
  list.push_back({{"kind", "resonance"},
                  {"frequency_hz", data::resonance_hz(p)},
                  {"damping_ratio", data::resonance_damping_ratio(p)},
                  {"source", "model"}});
  return list;
}

/// Margins of the real loop C G e^{-jwTd} (METHOD 10.2), from 6000 frequencies up to half the sample rate.
json loop_json(const plant::Truth& truth) {
  constexpr std::size_t kLines = 6000;
  constexpr double kSpan = 5e4;  // highest to lowest frequency
  const double highest_hz = 0.5 / truth.plant.sample_time_s;
  data::FrequencyResponse loop;
  for (std::size_t i = 0; i < kLines; ++i) {
    const double part = static_cast<double>(i + 1) / static_cast<double>(kLines);
    const double f = highest_hz * std::pow(kSpan, part - 1.0);
    loop.frequency_hz.push_back(f);
    loop.value.push_back(truth.controller->response(f) * truth.plant.response(f) *
                         std::polar(1.0, -kTwoPi * f * truth.delay_s));
  }
  const auto margins = diagnostics::loop_margins(loop);
  json result{{"modulus_margin", margins.modulus_margin}};
  if (const auto value = margins.crossover_hz()) result["crossover_hz"] = *value;
  if (const auto value = margins.phase_margin_deg()) result["phase_margin_deg"] = *value;
  if (margins.gain_margin_db) result["gain_margin_db"] = *margins.gain_margin_db;
  return result;
}

json response_json(const data::FrequencyResponse& response) {
  json re = json::array();
  json im = json::array();
  for (const auto& value : response.value) {
    re.push_back(value.real());
    im.push_back(value.imag());
  }
  return {{"frequency_hz", response.frequency_hz}, {"real", re}, {"imag", im}};
}

}  // namespace

json truth_json(const plant::Truth& truth) {
  json result{{"schema", "resonid.truth/1"},
              {"seed", truth.seed},
              {"delay_s", truth.delay_s},
              {"frequency_response", response_json(truth.response)},
              {"resonances", resonances_json(truth)}};
  result["model"] = {{"structure", truth.two_mass ? "two-mass" : "rigid"},
                     {"parameters", parameters_json(truth)},
                     {"transfer_function", transfer_function_json(truth.plant)}};
  if (truth.controller) {
    result["controller"] = transfer_function_json(*truth.controller);
    result["loop"] = loop_json(truth);
  }
  return result;
}

}  // namespace resonid::cli
