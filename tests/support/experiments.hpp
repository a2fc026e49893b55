// SPDX-License-Identifier: MIT
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <loop_of_two_masses.hpp>
#include <resonid/base/error_text.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/identification/identify.hpp>
#include <resonid/plant/experiment.hpp>
#include <string_view>

namespace resonid::test {

/// System 2 of Nevaranta 2016, Publication VI, with its controller, 4 ms of delay and 500 Hz; nothing
/// injected yet.
inline plant::ExperimentConfig published_drive(double noise, double reference = 0.0, std::uint64_t seed = 1) {
  auto c = loop_of_two_masses(0.032, 0.032, 5.75e4, 120.0, 1.036, 0.147);
  c.drive.radius_m = 0.05;
  c.measurement.delay_s = 0.004;
  c.measurement.noise_rms = noise;
  c.run.sample_rate_hz = 500.0;
  c.motion = {plant::MotionKind::constant, reference};
  c.run.seed = seed;
  return c;
}

/// The published sweep, 35 to 1.5 Hz in 17 s.
inline void sweep(plant::ExperimentConfig& c) {
  c.excitation.kind = online::Kind::chirp;
  c.excitation.from_hz = 35.0;
  c.excitation.to_hz = 1.5;
  c.excitation.duration_s = 17.0;
}

/// Five periods of a PRBS of 1023 bits.
inline void prbs(plant::ExperimentConfig& c) {
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 10;
  c.run.duration_s = 5.0 * 1023.0 / c.run.sample_rate_hz;
}

inline plant::Simulation simulated(const plant::ExperimentConfig& c, std::span<const double> grid_hz = {}) {
  auto simulation = plant::simulate_closed_loop(c, grid_hz);
  if (!simulation) throw std::runtime_error(message_of(simulation.error()));
  return std::move(*simulation);
}

/// The samples from `from_s` on.
inline data::Record cut_from(data::Record record, double from_s) {
  const auto first = static_cast<std::ptrdiff_t>(std::lround(from_s * record.sample_rate_hz));
  for (auto* channel :
       {&record.input, &record.output, &record.excitation, &record.reference, &record.position})
    if (channel->present())
      channel->samples.erase(channel->samples.begin(), channel->samples.begin() + first);
  return record;
}

/// What the user of such an experiment knows.
inline identification::Options known(const plant::ExperimentConfig& c) {
  identification::Options o;
  if (c.excitation.kind == online::Kind::chirp)
    o.chirp = {c.excitation.from_hz, c.excitation.to_hz, c.excitation.duration_s};
  if (c.controller.kind == plant::ControllerKind::pi)
    o.controller =
        data::pi_controller(c.controller.gain, c.controller.integral_time_s, 1.0 / c.run.sample_rate_hz);
  o.delay_s = c.measurement.delay_s;
  return o;
}

inline identification::Result identified(const data::Record& record, const identification::Options& options) {
  auto result = identification::identify(record, options);
  if (!result) throw std::runtime_error(message_of(result.error()));
  return std::move(*result);
}

inline const diagnostics::Finding* finding(const identification::Result& result, std::string_view id) {
  const auto found = std::find_if(result.findings.begin(), result.findings.end(),
                                  [&](const diagnostics::Finding& f) { return f.id == id; });
  return found == result.findings.end() ? nullptr : &*found;
}

/// Truth and estimate agree within `deviations` standard deviations, and those are below `most` of the value.
inline void expect_within(const data::Estimate& e, double truth, double deviations, double most) {
  EXPECT_NEAR(e.value, truth, deviations * e.std);
  EXPECT_LT(e.std, most * std::abs(truth));
}

}  // namespace resonid::test
