// SPDX-License-Identifier: MIT
#include <resonid/c/models.h>

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

struct Physicals : Variants<Physicals, Forgetful, Remembering> {
  using Settings = resonid_physical_settings;
  using Results = resonid_physical_results;
  static constexpr std::uint32_t kId = family_of(RESONID_PHYSICAL), kTypes = 1;

  static Settings defaults(std::uint32_t) noexcept {
    const online::PhysicalTrackerConfig p;
    Settings s{};
    s.driven_inertia = plain(p.driven_inertia);
    s.load_inertia = plain(p.load_inertia);
    s.stiffness = plain(p.stiffness);
    s.damping = plain(p.damping);
    s.viscous_friction_nms_rad = plain(p.viscous_friction_nms_rad);
    s.coulomb_friction_nm = plain(p.coulomb_friction_nm);
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
  static expected<std::uint32_t> variant(const Settings& s) noexcept { return s.replay_speed != 0 ? 1U : 0U; }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
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
    return variant == 0 ? make<Forgetful>(memory, variant, p) : make<Remembering>(memory, variant, p);
  }
  template <class Tracker>
  static void step(Tracker& tracker, double ru, double u, double y) noexcept {
    tracker.step(ru, u, y);
  }
  template <class Tracker>
  static constexpr std::uint32_t kParameters = RESONID_PHYSICAL_PARAMETERS;
  template <class Tracker>
  static void parameters(const Tracker& tracker, double* out) noexcept {
    for (int i = 0; i < RESONID_PHYSICAL_PARAMETERS; ++i)
      *out++ = tracker.value(static_cast<PhysicalParameter>(i));
  }
  template <class Tracker>
  static void covariance(const Tracker& tracker, double* out) noexcept {
    const auto matrix = tracker.covariance();
    for (int i = 0; i < RESONID_PHYSICAL_PARAMETERS; ++i)
      for (int j = 0; j < RESONID_PHYSICAL_PARAMETERS; ++j) *out++ = matrix(i, j);
  }
  template <class Tracker>
  static double lag_samples(const Tracker& tracker) noexcept {
    return tracker.lag_samples();
  }
  template <class Tracker>
  static void results(const Tracker& tracker, Results& r) noexcept {
    r.samples = tracker.samples();
    r.skipped_samples = tracker.skipped_samples();
    r.ready = tracker.ready() ? 1 : 0;
    r.converged = tracker.converged() ? 1 : 0;
    r.consistent = tracker.consistent() ? 1 : 0;
    r.excited = tracker.excited() ? 1 : 0;
    r.plausible = tracker.plausible() ? 1 : 0;
    parameters(tracker, r.value);
    const auto covariance = tracker.covariance();
    for (int i = 0; i < RESONID_PHYSICAL_PARAMETERS; ++i)
      r.standard_deviation[i] = std::sqrt(covariance(i, i));
    r.resonance_hz = tracker.resonance_hz();
    r.resonance_std_hz = tracker.resonance_std_hz();
    r.antiresonance_hz = tracker.antiresonance_hz();
    r.antiresonance_std_hz = tracker.antiresonance_std_hz();
    r.residual = tracker.residual();
    r.noise_rms = tracker.noise_rms();
    r.lag_samples = tracker.lag_samples();
  }

 private:
  /// Not inline: else the stack of the small one were that of the large one.
  template <class Tracker>
  [[gnu::noinline]] static expected<void> make(void* memory, std::uint32_t variant,
                                               const online::PhysicalTrackerConfig& config) noexcept {
    return place(memory, RESONID_PHYSICAL, variant, Tracker::create(config));
  }
};

}  // namespace

const Family kPhysical = FamilyOf<Physicals>::kFamily;

}  // namespace resonid::c
