// SPDX-License-Identifier: MIT
#include "reproduce/vi_offline.hpp"

#include <fmt/format.h>

#include <cassert>
#include <resonid/fit/response_fit.hpp>
#include <resonid/response/welch.hpp>

namespace resonid::reproduction::vi {

data::FrequencyResponse averaged_response(const data::Record& record, const Known& known, Approach approach) {
  response::WelchConfig config;
  config.segment_samples = 4096;
  response::ResponseOptions options;
  options.approach = approach;
  options.controller = known.controller;
  options.delay_s = known.delay_s;
  auto response = response::welch(record, config, options);
  assert(response);
  return std::move(*response);
}

data::TwoMassParameters fitted_two_mass(const data::FrequencyResponse& response, double sample_time_s,
                                        const data::TwoMassParameters& start, ModelKind kind, double low_hz,
                                        double high_hz) {
  // The hold's half sample is all that tells the two models apart: held for 0.1 us, the sampled model is the
  // continuous one within 1e-5 rad.
  constexpr double kNoTime_s = 1e-7;
  fit::ResponseFitConfig config;
  config.structure = fit::Structure::two_mass;
  config.sample_time_s = kind == ModelKind::sampled ? sample_time_s : kNoTime_s;
  config.weighting = fit::Weighting::none;
  config.low_hz = low_hz;
  config.high_hz = high_hz;
  fit::DriveModel initial;
  initial.structure = fit::Structure::two_mass;
  initial.parameters = start;
  config.initial = initial;
  data::FrequencyResponse plain =
      response;  // the published fit knows nothing of what the window does to lines
  plain.smoothing = {};
  plain.correlation = {};
  const auto fit = fit::fit_response(plain, config);
  assert(fit);
  return fit->model.parameters;
}

BeltValues belt_values(const data::TwoMassParameters& p) {
  constexpr double kSquare = kRollerRadius_m * kRollerRadius_m;
  return {p.stiffness / kSquare, p.damping / kSquare,   p.driven_inertia,
          p.load_inertia,        data::resonance_hz(p), data::antiresonance_hz(p)};
}

std::string percent(double value, double truth) {
  return fmt::format("{:+.2f} %", 100.0 * (value / truth - 1.0));
}

data::FrequencyResponse model_response(const data::TwoMassParameters& parameters, double sample_time_s,
                                       std::span<const double> frequencies_hz) {
  fit::DriveModel model;
  model.structure = fit::Structure::two_mass;
  model.parameters = parameters;
  model.sample_time_s = sample_time_s;
  data::FrequencyResponse g;
  g.frequency_hz.assign(frequencies_hz.begin(), frequencies_hz.end());
  g.value = model.values(frequencies_hz);
  return g;
}

}  // namespace resonid::reproduction::vi
