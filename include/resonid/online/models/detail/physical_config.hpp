// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <resonid/base/expected.hpp>

namespace resonid::online {

/// What is known of a positive parameter at the start: a value and by which factor it may be off.
struct StartingValue {
  double value = 0.0;         ///< > 0.
  double relative_std = 0.5;  ///< Standard deviation of its logarithm, >= 0; 0: known, not estimated.
};

/// A parameter of any sign: value and standard deviation in its own unit; 0: known, not estimated.
struct StartingFriction {
  double value = 0.0;
  double std = 0.0;
};

/// Linear machines: kg, N/m, Ns/m, N in place of kgm2, Nm/rad, Nms/rad, Nm.
struct PhysicalTrackerConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  double delay_s = 0.0;         ///< Known delay of the measured velocity, 0 ... 64 samples; any fraction.

  StartingValue driven_inertia;               ///< J1, kgm2
  StartingValue load_inertia;                 ///< J2, kgm2
  StartingValue stiffness;                    ///< K, Nm/rad
  StartingValue damping;                      ///< D, Nms/rad
  StartingFriction viscous_friction_nms_rad;  ///< B on the driven side.
  StartingFriction coulomb_friction_nm;       ///< Tc on the driven side, times the sign of its velocity.

  /// How far a constant torque that u does not hold (load, weight, friction) may lie from 0, Nm; 0: there is
  /// none. Without it an unknown load makes the estimate diverge.
  double torque_offset_std_nm = 1.0;
  double torque_offset_drift_nm_rt_s = 0.005;  ///< How it wanders: standard deviation after a second, Nm.

  /// Relative change of the stiffness per second while the machine moves, about the mean over a run, 1/s; 0:
  /// it stays. A cart that crosses in 20 s a stroke over which K falls to 40 %: 0.05; in 3 s: 0.3.
  double stiffness_drift_per_s = 0.0;
  /// With a drifting stiffness: tell of the machine as it was lag_samples() ago, where K is known best,
  /// instead of now: up to two times as accurate.
  bool at_best_known_time = false;
  /// How ln D wanders with it, at most: standard deviation after a second. 0.28 stiffness_drift_per_s where
  /// that is less: D then follows at half the rate of K, as it does at a constant damping ratio.
  double damping_drift_per_rt_s = 0.1;

  /// Memory of all parameters, s: samples count by exp(-age/memory), as long as the machine moves enough to
  /// tell of them. 0: inertias and friction stay, stiffness and damping as told above.
  double memory_s = 0.0;

  double noise_rms = 0.0;              ///< White noise of the output; 0: estimated from the innovations.
  double noise_memory_s = 0.0;         ///< Memory of that estimate; 0: all samples.
  double start_velocity_std = 1.0;     ///< Both velocities and the scaled twist about the first output, > 0.
  double plant_noise_variance = 1e-9;  ///< Process noise of each plant state per sample, >= 0: hardly any.
  std::uint32_t refresh_samples = 10;  ///< Between two exact discretisations, >= 1.
  std::uint32_t replay_speed = 6;      ///< Old samples per new one while the start is gone over; 0: never.

  static constexpr double kMaxDelaySamples = 64.0;
};

[[nodiscard]] inline std::optional<Error> check(const PhysicalTrackerConfig& c) noexcept {
  const auto bad = [](double x) { return !std::isfinite(x) || x < 0.0; };
  if (!(c.sample_rate_hz > 0.0) || !std::isfinite(c.sample_rate_hz))
    return Error{"sample_rate_hz", "must be > 0", c.sample_rate_hz};
  if (bad(c.delay_s) || c.delay_s * c.sample_rate_hz > PhysicalTrackerConfig::kMaxDelaySamples)
    return Error{"delay_s", "must lie between 0 and 64 samples", c.delay_s};
  const struct {
    const StartingValue* start;
    const char* name;
  } positive[] = {{&c.driven_inertia, "driven_inertia"},
                  {&c.load_inertia, "load_inertia"},
                  {&c.stiffness, "stiffness"},
                  {&c.damping, "damping"}};
  for (const auto& p : positive) {
    if (!(p.start->value > 0.0) || !std::isfinite(p.start->value))
      return Error{p.name, "must start at a value > 0", p.start->value};
    if (bad(p.start->relative_std))
      return Error{p.name, "must start with a standard deviation >= 0", p.start->relative_std};
  }
  const struct {
    double value;
    const char* name;
  } not_negative[] = {{c.viscous_friction_nms_rad.std, "viscous_friction_nms_rad"},
                      {c.coulomb_friction_nm.std, "coulomb_friction_nm"},
                      {c.torque_offset_std_nm, "torque_offset_std_nm"},
                      {c.torque_offset_drift_nm_rt_s, "torque_offset_drift_nm_rt_s"},
                      {c.stiffness_drift_per_s, "stiffness_drift_per_s"},
                      {c.damping_drift_per_rt_s, "damping_drift_per_rt_s"},
                      {c.memory_s, "memory_s"},
                      {c.noise_rms, "noise_rms"},
                      {c.noise_memory_s, "noise_memory_s"},
                      {c.plant_noise_variance, "plant_noise_variance"}};
  for (const auto& f : not_negative)
    if (bad(f.value)) return Error{f.name, "must be >= 0", f.value};
  if (!std::isfinite(c.viscous_friction_nms_rad.value))
    return Error{"viscous_friction_nms_rad", "must be finite", c.viscous_friction_nms_rad.value};
  if (!std::isfinite(c.coulomb_friction_nm.value))
    return Error{"coulomb_friction_nm", "must be finite", c.coulomb_friction_nm.value};
  if (!(c.start_velocity_std > 0.0) || !std::isfinite(c.start_velocity_std))
    return Error{"start_velocity_std", "must be > 0", c.start_velocity_std};
  if (c.refresh_samples == 0) return Error{"refresh_samples", "must be >= 1", 0.0};
  return std::nullopt;
}

}  // namespace resonid::online
