// SPDX-License-Identifier: MIT
#include <fit/drive/drive_signals.hpp>
#include <numeric>

namespace resonid::fit::detail {

DriveSignals whitened(const DriveSignals& raw, const NoiseModel& noise) {
  if (noise.order() == 0) return raw;
  DriveSignals s;
  s.input = whiten(raw.input, noise);
  s.reference = whiten(raw.reference, noise);
  s.output = whiten(raw.output, noise);
  s.direction = whiten(raw.direction, noise);
  s.stuck = whiten(raw.stuck, noise);
  for (std::size_t part = 0; part < kFrictionParts; ++part) {
    s.direction_parts[part] = whiten(raw.direction_parts[part], noise);
    s.stuck_parts[part] = whiten(raw.stuck_parts[part], noise);
    s.on_load[part] = whiten(raw.on_load[part], noise);
  }
  s.unused = touched(raw.unused, noise);
  s.constant = std::accumulate(noise.polynomial.begin(), noise.polynomial.end(), 0.0);
  return s;
}

std::vector<double> friction_of(const DriveSignals& s, double coulomb) {
  std::vector<double> torque;
  torque.reserve(kFrictionParts * s.stuck.size());
  for (std::size_t k = 0; k < s.stuck.size(); ++k)
    for (std::size_t part = 0; part < kFrictionParts; ++part) {
      const bool even = s.stuck_parts[part].empty();
      torque.push_back(coulomb * (s.direction[k] + (even ? 0.0 : s.direction_parts[part][k])) + s.stuck[k] +
                       (even ? 0.0 : s.stuck_parts[part][k]));
    }
  return torque;
}

void take_friction(std::span<const double> torque, DriveSignals& s) {
  const std::size_t samples = torque.size() / kFrictionParts;
  s.stuck.assign(samples, 0.0);
  s.stuck_parts.fill(s.stuck);
  for (std::size_t k = 0; k < samples; ++k) {
    for (std::size_t part = 0; part < kFrictionParts; ++part)
      s.stuck[k] += torque[kFrictionParts * k + part] / kFrictionParts;
    for (std::size_t part = 0; part < kFrictionParts; ++part)
      s.stuck_parts[part][k] = torque[kFrictionParts * k + part] - s.stuck[k];
  }
}

std::vector<double> load_friction_of(const DriveSignals& s) {
  std::vector<double> torque;
  for (std::size_t k = 0; k < s.on_load.front().size(); ++k)
    for (const auto& part : s.on_load) torque.push_back(part[k]);
  return torque;
}

void take_load_friction(std::span<const double> torque, DriveSignals& s) {
  for (std::size_t part = 0; part < kFrictionParts; ++part) {
    s.on_load[part].clear();
    for (std::size_t at = part; at < torque.size(); at += kFrictionParts)
      s.on_load[part].push_back(torque[at]);
  }
}

}  // namespace resonid::fit::detail
