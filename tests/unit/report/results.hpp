// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/result.hpp>

namespace resonid::report::test {

/// The least that identify() gives: a response, and nothing made of it.
inline identification::Result bare() {
  identification::Result r;
  r.record = {"bench.csv", 1000, 500.0, "t", "u", "y", "", "", data::OutputQuantity::velocity};
  r.units = {"Nm", "rad/s", "(rad/s)/Nm", "kgm2", "Nm/rad", "Nms/rad", "Nm", true};
  r.method = "welch";
  r.approach = "direct";
  r.response.frequency_hz = {1.0, 2.0, 3.0};
  r.response.value = {{1.0, -2.0}, {0.5, -1.0}, {0.25, -0.5}};
  return r;
}

inline fit::DriveModel two_mass() {
  fit::DriveModel m;
  m.structure = fit::Structure::two_mass;
  m.parameters = {0.032, 0.032, 143.75, 0.3, 0.0};
  m.sample_time_s = 0.002;
  m.estimated = fit::estimated_parameters(m.structure, false, false);
  for (int i = 0; i < 4; ++i) m.covariance(i, i) = 1e-8;
  return m;
}

/// With all that can be told.
inline identification::Result full() {
  identification::Result r = bare();
  r.record.excitation = "ru";
  r.record.reference = "r";
  r.approach = "joint";
  r.known_delay_s = 0.004;
  r.response.standard_deviation = {0.1, 0.1, 0.1};
  r.response.coherence = {0.9, 0.99, 0.999};
  r.resonances = {{true, 10.67, 0.03, 0.07, true}, {false, 15.09, 0.02, 0.10, true}};
  r.model = identification::ModelResult{two_mass(), true, 0.01, std::nullopt, fit::Estimate{0.1, 0.01}};
  identification::LoopResult loop;
  loop.source = "model";
  loop.margins.crossovers = {{2.7, 63.5}};
  loop.margins.worst_phase_margin_deg = 63.5;
  loop.margins.modulus_margin = 0.85;
  loop.margins.modulus_margin_hz = 27.0;
  loop.margins.gain_margin_db = 19.2;
  r.loop = loop;
  r.validation = identification::Validation{92.0, true, 0.01, 0.0235};
  r.trusted = true;
  r.findings = {{"low-coherence", diagnostics::Severity::warning, 0.4, 0.8, "Coherence falls."}};
  return r;
}

}  // namespace resonid::report::test
