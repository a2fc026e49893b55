// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <resonid/fit/detail/inverse_dynamics.hpp>
#include <vector>

namespace resonid::test {

/// A rigid axis in a velocity loop that goes to and fro, integrated in steps of a fortieth of a sample.
struct MovingAxis {
  double inertia = 0.02, viscous = 0.03, offset = 0.15;  // kgm2, Nms/rad, Nm
  double forth = 0.5, back = 0.5;                        // Coulomb friction of either direction, Nm
  double breakaway = 0.0, stribeck = 1.0;                // more of it near standstill, Nm; rad/s
  double rate_hz = 1000.0, duration_s = 6.0;
  double noise = 0.02;   // rad/s
  std::size_t late = 2;  // samples
  double away = -1.0;    // velocity of the way back over that forth
};

inline data::Record simulated(const MovingAxis& m, unsigned seed, data::OutputQuantity quantity) {
  constexpr int kSteps = 40;
  constexpr double kTop = 20.0, kRamp = 0.1, kCycle = 1.2;  // rad/s, s, s
  std::mt19937 generator(seed);
  std::normal_distribution<double> noise(0.0, m.noise);
  const auto n = static_cast<std::size_t>(m.duration_s * m.rate_hz);
  std::vector<double> velocity, position;
  data::Record record;
  record.sample_rate_hz = m.rate_hz;
  record.output_quantity = quantity;
  const double step = 1.0 / (m.rate_hz * kSteps), gain = m.inertia * 80.0;
  double v = 0.0, x = 0.0, integral = 0.0;
  std::vector<double> measured;
  for (std::size_t k = 0; k < n; ++k) {
    velocity.push_back(v);
    position.push_back(x);
    measured.push_back((k >= m.late ? velocity[k - m.late] : 0.0) + noise(generator));
    const double t = std::fmod(static_cast<double>(k) / m.rate_hz, kCycle), half = 0.5 * kCycle;
    const double s = t < half ? t : t - half;
    const double shape = std::clamp(std::min((s - 0.05) / kRamp, (half - 0.05 - s) / kRamp), 0.0, 1.0);
    const double goal = kTop * (t < half ? 1.0 : m.away) * shape;
    record.reference.samples.push_back(goal);
    const double error = goal - measured[k];
    integral += gain * 15.0 * error / m.rate_hz;
    const double torque = gain * error + integral;
    record.input.samples.push_back(torque);
    for (int i = 0; i < kSteps; ++i) {
      const double more = m.breakaway * std::exp(-std::pow(v / m.stribeck, 2));
      const double drive = torque + m.offset - m.viscous * v;
      const double friction = (drive > 0.0 || v > 0.0 ? m.forth : m.back) + more;
      const double way = v != 0.0 ? (v > 0.0 ? 1.0 : -1.0) : (drive > 0.0 ? 1.0 : -1.0);
      const double dry = (way > 0.0 ? m.forth : m.back) + more;
      if (v == 0.0 && std::abs(drive) <= friction) continue;
      const double next = v + step * (drive - way * dry) / m.inertia;
      const double before = v;
      v = v != 0.0 && next * v < 0.0 ? 0.0 : next;
      x += step * 0.5 * (before + v);
    }
  }
  if (quantity == data::OutputQuantity::velocity) {
    record.output.samples = measured;
  } else {
    record.reference = {};  // of velocity
    std::normal_distribution<double> rounding(0.0, 4.0 * m.noise / m.rate_hz);
    for (std::size_t k = 0; k < n; ++k)
      record.output.samples.push_back((k >= m.late ? position[k - m.late] : 0.0) + rounding(generator));
  }
  return record;
}

inline fit::InverseDynamicsConfig told(const MovingAxis& m) {
  fit::InverseDynamicsConfig config;
  config.known_delay_s = static_cast<double>(m.late) / m.rate_hz;
  return config;
}

/// Errors over error bars of inertia, viscous friction, dry friction and offset.
inline std::array<double, 4> deviations(const MovingAxis& m, const fit::InverseDynamics& found) {
  const auto off = [](const data::Estimate& e, double truth) { return (e.value - truth) / e.std; };
  return {off(found.inertia, m.inertia), off(found.viscous_friction, m.viscous),
          off(found.coulomb_friction.value_or(data::Estimate{}), 0.5 * (m.forth + m.back)),
          off(found.offset, m.offset - 0.5 * (m.forth - m.back))};
}

}  // namespace resonid::test
