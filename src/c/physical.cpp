// SPDX-License-Identifier: MIT
#include <resonid/c/physical.h>

#include <resonid/online/models/physical_tracker.hpp>

#include "handle.hpp"

namespace resonid::online {
extern template class PhysicalTracker<double>;
extern template class PhysicalTracker<double, 0>;
}  // namespace resonid::online

namespace resonid::c {
namespace {

using Forgetful = online::PhysicalTracker<double, 0>;
using Remembering = online::PhysicalTracker<double>;
using online::PhysicalParameter;
static_assert(Remembering::kParameters == RESONID_PHYSICAL_PARAMETERS);
static_assert(static_cast<int>(PhysicalParameter::coulomb_friction) == RESONID_COULOMB_FRICTION);

resonid_start plain(const online::StartingValue& v) noexcept { return {v.value, v.relative_std}; }
resonid_start_friction plain(const online::StartingFriction& v) noexcept { return {v.value, v.std}; }

resonid_physical_config physical_defaults() noexcept {
  const online::PhysicalTrackerConfig p;
  resonid_physical_config c{};
  c.replay = 1;
  c.driven_inertia = plain(p.driven_inertia);
  c.load_inertia = plain(p.load_inertia);
  c.stiffness = plain(p.stiffness);
  c.damping = plain(p.damping);
  c.viscous_friction_nms_rad = plain(p.viscous_friction_nms_rad);
  c.coulomb_friction_nm = plain(p.coulomb_friction_nm);
  c.torque_offset_std_nm = p.torque_offset_std_nm;
  c.torque_offset_drift_nm_rt_s = p.torque_offset_drift_nm_rt_s;
  c.stiffness_drift_per_s = p.stiffness_drift_per_s;
  c.damping_drift_per_rt_s = p.damping_drift_per_rt_s;
  c.noise_rms = p.noise_rms;
  c.noise_memory_s = p.noise_memory_s;
  c.start_velocity_std = p.start_velocity_std;
  c.plant_noise_variance = p.plant_noise_variance;
  c.refresh_samples = p.refresh_samples;
  c.replay_speed = p.replay_speed;
  return c;
}

struct Physicals : Variants<RESONID_FAMILY_PHYSICAL, Forgetful, Remembering> {
  using Config = resonid_physical_config;
  using Handle = resonid_physical;

  static Config defaults_for(const Config*) noexcept { return physical_defaults(); }
  static expected<std::uint32_t, Error> variant(const Config& c) noexcept {
    return c.replay != 0 && c.replay_speed != 0 ? 1U : 0U;
  }
  static std::size_t size(std::uint32_t variant) noexcept { return kSize[variant]; }
  static expected<void, Error> build(void* memory, std::uint32_t variant, const Config& c) noexcept {
    const auto start = [](const resonid_start& s) { return online::StartingValue{s.value, s.relative_std}; };
    const auto friction = [](const resonid_start_friction& s) {
      return online::StartingFriction{s.value, s.std};
    };
    online::PhysicalTrackerConfig p;
    p.sample_rate_hz = c.sample_rate_hz;
    p.delay_s = c.delay_s;
    p.driven_inertia = start(c.driven_inertia);
    p.load_inertia = start(c.load_inertia);
    p.stiffness = start(c.stiffness);
    p.damping = start(c.damping);
    p.viscous_friction_nms_rad = friction(c.viscous_friction_nms_rad);
    p.coulomb_friction_nm = friction(c.coulomb_friction_nm);
    p.torque_offset_std_nm = c.torque_offset_std_nm;
    p.torque_offset_drift_nm_rt_s = c.torque_offset_drift_nm_rt_s;
    p.stiffness_drift_per_s = c.stiffness_drift_per_s;
    p.damping_drift_per_rt_s = c.damping_drift_per_rt_s;
    p.noise_rms = c.noise_rms;
    p.noise_memory_s = c.noise_memory_s;
    p.start_velocity_std = c.start_velocity_std;
    p.plant_noise_variance = c.plant_noise_variance;
    p.refresh_samples = c.refresh_samples;
    p.replay_speed = c.replay_speed;
    return variant == 0 ? make<Forgetful>(memory, variant, p) : make<Remembering>(memory, variant, p);
  }

 private:
  template <class T>
  static expected<void, Error> make(void* memory, std::uint32_t variant,
                                    const online::PhysicalTrackerConfig& config) noexcept {
    const auto made = T::create(config);
    if (!made) return unexpected<Error>(made.error());
    place(memory, kFamily, variant, *made);
    return {};
  }
};

}  // namespace
}  // namespace resonid::c

using resonid::c::Physicals;
using resonid::online::PhysicalParameter;

resonid_status resonid_physical_defaults(resonid_physical_config* config, size_t struct_size) noexcept {
  return resonid::c::give_defaults(resonid::c::physical_defaults(), config, struct_size);
}
size_t resonid_physical_size(const resonid_physical_config* config) noexcept {
  return resonid::c::size_of<Physicals>(config);
}
resonid_status resonid_physical_init(void* memory, size_t size, const resonid_physical_config* config,
                                     resonid_physical** handle, resonid_error* error) noexcept {
  return resonid::c::init<Physicals>(memory, size, config, handle, error);
}
resonid_status resonid_physical_create(const resonid_physical_config* config, resonid_physical** handle,
                                       resonid_error* error) noexcept {
  return resonid::c::create<Physicals>(config, handle, error);
}
resonid_status resonid_physical_step(resonid_physical* handle, double ru, double u, double y) noexcept {
  return Physicals::visit(handle, [&](auto& tracker) { tracker.step(ru, u, y); });
}
resonid_status resonid_physical_run(resonid_physical* handle, const double* ru, const double* u,
                                    const double* y, size_t count) noexcept {
  if (count > 0 && (u == nullptr || y == nullptr)) return RESONID_ERROR_NULL;
  return Physicals::visit(handle, [&](auto& tracker) {
    for (std::size_t k = 0; k < count; ++k) tracker.step(ru != nullptr ? ru[k] : 0.0, u[k], y[k]);
  });
}
resonid_status resonid_physical_miss(resonid_physical* handle, uint64_t count) noexcept {
  return Physicals::visit(handle, [&](auto& tracker) { tracker.miss(count); });
}
resonid_status resonid_physical_reset(resonid_physical* handle) noexcept {
  return Physicals::visit(handle, [](auto& tracker) { tracker.reset(); });
}
resonid_status resonid_physical_covariance(const resonid_physical* handle, double* covariance,
                                           size_t count) noexcept {
  constexpr std::size_t kN = RESONID_PHYSICAL_PARAMETERS;
  if (const resonid_status status = resonid::c::check_array(covariance, count, kN * kN)) return status;
  return Physicals::visit(handle, [&](const auto& tracker) {
    const auto matrix = tracker.covariance();
    for (std::size_t i = 0; i < count; ++i)
      covariance[i] = matrix(static_cast<int>(i / kN), static_cast<int>(i % kN));
  });
}
resonid_status resonid_physical_get_info(const resonid_physical* handle, resonid_physical_info* info,
                                         size_t struct_size) noexcept {
  resonid_physical_info found{};
  const resonid_status status = Physicals::visit(handle, [&](const auto& tracker) {
    found.ready = tracker.ready() ? 1 : 0;
    found.converged = tracker.converged() ? 1 : 0;
    found.consistent = tracker.consistent() ? 1 : 0;
    found.excited = tracker.excited() ? 1 : 0;
    found.plausible = tracker.plausible() ? 1 : 0;
    found.samples = tracker.samples();
    found.skipped_samples = tracker.skipped_samples();
    const auto covariance = tracker.covariance();
    for (int i = 0; i < RESONID_PHYSICAL_PARAMETERS; ++i) {
      found.value[i] = tracker.value(static_cast<PhysicalParameter>(i));
      found.standard_deviation[i] = std::sqrt(covariance(i, i));
    }
    found.resonance_hz = tracker.resonance_hz();
    found.resonance_std_hz = tracker.resonance_std_hz();
    found.antiresonance_hz = tracker.antiresonance_hz();
    found.antiresonance_std_hz = tracker.antiresonance_std_hz();
    found.residual = tracker.residual();
    found.noise_rms = tracker.noise_rms();
    found.lag_samples = tracker.lag_samples();
  });
  return status != RESONID_OK ? status : resonid::c::give(found, info, struct_size);
}
