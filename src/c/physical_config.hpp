// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/c/detail/models.h>

#include <resonid/online/models/detail/physical_config.hpp>

#include "handle.hpp"

namespace resonid::c {

struct PhysicalDefaults {
  using Settings = resonid_physical_settings;
  static Settings defaults(std::uint32_t) noexcept {
    const online::PhysicalTrackerConfig p;
    Settings s{};
    s.driven_inertia = plain_start(p.driven_inertia);
    s.load_inertia = plain_start(p.load_inertia);
    s.stiffness = plain_start(p.stiffness);
    s.damping = plain_start(p.damping);
    s.viscous_friction_nms_rad = plain_friction(p.viscous_friction_nms_rad);
    s.coulomb_friction_nm = plain_friction(p.coulomb_friction_nm);
    s.torque_offset_std_nm = p.torque_offset_std_nm;
    s.torque_offset_drift_nm_rt_s = p.torque_offset_drift_nm_rt_s;
    s.stiffness_drift_per_s = p.stiffness_drift_per_s;
    s.damping_drift_per_rt_s = p.damping_drift_per_rt_s;
    s.noise_rms = p.noise_rms;
    s.noise_memory_s = p.noise_memory_s;
    s.start_velocity_std = p.start_velocity_std;
    s.plant_noise_variance = p.plant_noise_variance;
    s.refresh_samples = p.refresh_samples;
    s.replay_speed = p.replay_speed;
    return s;
  }

 private:
  static resonid_start plain_start(const online::StartingValue& v) noexcept {
    return {v.value, v.relative_std};
  }
  static resonid_start_friction plain_friction(const online::StartingFriction& v) noexcept {
    return {v.value, v.std};
  }
};

[[nodiscard]] inline online::PhysicalTrackerConfig physical_config(
    const resonid_physical_settings& s) noexcept {
  const auto start = [](const resonid_start& x) { return online::StartingValue{x.value, x.relative_std}; };
  const auto friction = [](const resonid_start_friction& x) {
    return online::StartingFriction{x.value, x.std};
  };
  online::PhysicalTrackerConfig p;
  p.sample_rate_hz = s.sample_rate_hz;
  p.delay_s = s.delay_s;
  p.driven_inertia = start(s.driven_inertia);
  p.load_inertia = start(s.load_inertia);
  p.stiffness = start(s.stiffness);
  p.damping = start(s.damping);
  p.viscous_friction_nms_rad = friction(s.viscous_friction_nms_rad);
  p.coulomb_friction_nm = friction(s.coulomb_friction_nm);
  p.torque_offset_std_nm = s.torque_offset_std_nm;
  p.torque_offset_drift_nm_rt_s = s.torque_offset_drift_nm_rt_s;
  p.stiffness_drift_per_s = s.stiffness_drift_per_s;
  p.damping_drift_per_rt_s = s.damping_drift_per_rt_s;
  p.noise_rms = s.noise_rms;
  p.noise_memory_s = s.noise_memory_s;
  p.start_velocity_std = s.start_velocity_std;
  p.plant_noise_variance = s.plant_noise_variance;
  p.refresh_samples = s.refresh_samples;
  p.replay_speed = s.replay_speed;
  return p;
}

}  // namespace resonid::c
