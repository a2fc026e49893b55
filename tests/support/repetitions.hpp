// SPDX-License-Identifier: MIT
#pragma once

#include <experiments.hpp>
#include <vector>

// Repetitions of an experiment on a drive that is not ideal, to be compared.
namespace resonid::test {

/// System 2 of Nevaranta 2016, Publication VI, in motion: dry friction, torque lag and a velocity from
/// encoder counts. Each seed excites with other phases.
inline plant::ExperimentConfig real_drive(std::uint64_t seed, double stiffness = 1.0) {
  auto c = published_drive(0.0, 10.0, seed);
  c.measurement.velocity = plant::VelocitySource::encoder;
  c.measurement.encoder_counts = 65536;
  c.drive.stiffness *= stiffness;
  c.friction.driven.coulomb = 0.3;
  c.actuator.lag_s = 0.001;
  c.excitation.kind = online::Kind::multisine;
  c.excitation.amplitude = 0.4;
  std::vector<double> lines;
  for (int i = 4; i <= 120; ++i) lines.push_back(0.25 * i);
  c.excitation.lines_hz.assign(lines);
  c.excitation.seed = seed;
  c.excitation.phases = online::Phases::random;
  c.run.duration_s = 20.0;
  return c;
}

inline identification::Result identified_repetition(std::uint64_t seed, double stiffness = 1.0) {
  const auto c = real_drive(seed, stiffness);
  return identified(simulated(c).record, known(c));
}

}  // namespace resonid::test
