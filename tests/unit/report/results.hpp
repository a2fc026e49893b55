// SPDX-License-Identifier: MIT
#pragma once

#include <limits>
#include <resonid/identification/result.hpp>

namespace resonid::report::test {

inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// The least that identify() gives: a response, and nothing made of it.
inline identification::Result bare() {
  identification::Result r;
  r.record = {"bench.csv", 1000, 500.0, "t", "u", "y", "", "", data::OutputQuantity::velocity, {}};
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
  r.response.std = {0.1, 0.1, 0.1};
  r.response.coherence = {0.9, 0.99, 0.999};
  r.modes = {{true, {10.67, 0.03}, {0.07, kUnknown}}, {false, {15.09, 0.02}, {0.10, kUnknown}}};
  r.model = identification::ModelResult{two_mass(), true, 0.01, std::nullopt, data::Estimate{0.1, 0.01}};
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

/// full() with all lists: choices, structures, poles and zeros, bootstrap.
inline identification::Result listed() {
  identification::Result r = full();
  r.modes[1].damping_ratio.std = 0.004;
  r.loop->gain_margin_std_db = 0.2;
  r.choices = {{"method", "local-cubic", "The excitation is a chirp."},
               {"structure", "two-mass", "It has the least criterion."}};
  r.independent = identification::IndependentValidation{"other.csv", "direct", 88.5, 95.0, 0.02, "accepted"};
  r.structures = {{"rigid", 2, 120.5, 60.0, -800.0, false, "A resonance shows."},
                  {"two-mass", 4, -300.25, 92.0, -2000.0, true, ""},
                  {"three-mass", 7, -290.0, std::nullopt, std::nullopt, false, ""}};
  r.structures[1].independent_fit_percent = 88.5;
  Eigen::Matrix2d c;
  c << 0.04, 0.01, 0.01, 0.09;
  r.roots = {{{-9.4, 94.3}, c, "pole"}, {{-9.4, -94.3}, c, "pole"}, {{-4.7, 66.9}, c, "zero"}};
  r.bootstrap = identification::Bootstrap{200,
                                          3,
                                          {{"stiffness", "Nm/rad", 142.9, 144.6, 0.4, {143.0, 144.0, 143.5}},
                                           {"modulus_margin", "", 0.84, 0.86, 0.004, {0.85, 0.86, 0.84}}}};
  return r;
}

/// full() with what was measured at the load.
inline identification::Result with_second_output() {
  identification::Result r = full();
  r.second_output = identification::SecondOutputResult{data::SecondOutput::load_accelerometer,
                                                       "tool_acc",
                                                       "(rad/s)/Nm",
                                                       r.response,
                                                       true,
                                                       0.02,
                                                       data::Estimate{0.95, 0.004},
                                                       data::Estimate{0.001, 0.0001}};
  return r;
}

/// full() with distortion by realisations and at detection lines.
inline identification::Result distorted() {
  identification::Result r = full();
  r.method = "best-linear";
  identification::Distortion d;
  d.realisations = 8;
  d.noise_std = {0.01, 0.02, 0.015};
  d.distortion_std = {0.1, 0.0, 0.05};
  d.scatter = {3, 0.12, 0.01, true};
  d.odd = {12, 0.08, 0.002, true};
  d.even = {40, 0.001, 0.002, false};
  r.distortion = d;
  return r;
}

/// A model without drive structure.
inline identification::Result black_box() {
  identification::Result r = bare();
  identification::BlackBoxResult box;
  box.model.transfer_function = {{0.0, 0.03, -0.05}, {1.0, -1.9, 0.95}, 0.002};
  box.model.delay_samples = 2;
  box.model.covariance = Eigen::MatrixXd::Identity(5, 5) * 1e-6;
  box.model.covariance(0, 0) = 0.0;
  box.model.covariance(1, 4) = box.model.covariance(4, 1) = 2e-7;
  box.fit_percent = 87.5;
  box.further_delay = data::Estimate{0.0015, 2e-5};
  r.black_box = box;
  return r;
}

}  // namespace resonid::report::test
