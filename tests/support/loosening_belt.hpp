// SPDX-License-Identifier: MIT
#pragma once

#include <experiments.hpp>
#include <memory>
#include <resonid/online/models/physical_tracker.hpp>
#include <resonid/online/supervision/change_detection.hpp>

namespace resonid::test {

/// The coupled belt under a PRBS of 2.1 Nm and noise of 0.1 rad/s, watched by the physical tracker's
/// resonance.
inline plant::ExperimentConfig watched_belt(double duration_s, std::uint64_t seed) {
  auto c = published_drive(0.1, 10.0, seed);
  c.excitation.kind = online::Kind::prbs;
  c.excitation.register_length = 17;
  c.excitation.amplitude = 2.1;
  c.run.duration_s = duration_s;
  return c;
}

/// A tracker of short memory (blocks of half a second of what it gives are independent), started 10 % off.
inline auto belt_tracker() {
  online::PhysicalTrackerConfig p;
  p.sample_rate_hz = 500.0;
  p.delay_s = 0.004;
  p.driven_inertia = {1.1 * 0.032, 0.5};
  p.load_inertia = {0.9 * 0.032, 0.5};
  p.stiffness = {1.1 * 143.75, 0.5};
  p.damping = {0.9 * 0.3, 0.5};
  p.stiffness_drift_per_s = 0.3;
  using Tracker = online::PhysicalTracker<double>;
  return std::make_unique<Tracker>(*Tracker::create(p));
}

inline online::ChangeDetectorConfig belt_detector(double baseline_s, double interval_s) {
  online::ChangeDetectorConfig d;
  d.sample_rate_hz = 500.0;
  d.block_s = 0.5;
  d.baseline_s = baseline_s;
  d.false_alarm_interval_s = interval_s;
  return d;
}

}  // namespace resonid::test
