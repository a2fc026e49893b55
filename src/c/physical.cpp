// SPDX-License-Identifier: MIT
#include <resonid/c/detail/models.h>

#include <resonid/online/models/physical_tracker.hpp>

#include "handle.hpp"
#include "physical_config.hpp"

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

struct Physicals : Variants<Physicals, Forgetful, Remembering> {
  using Settings = resonid_physical_settings;
  using Results = resonid_physical_results;
  static constexpr std::uint32_t kId = family_of(RESONID_PHYSICAL), kTypes = 1;

  static Settings defaults(std::uint32_t kind) noexcept { return PhysicalDefaults::defaults(kind); }
  static expected<std::uint32_t> variant(const Settings& s) noexcept { return s.replay_speed != 0 ? 1U : 0U; }
  static expected<void> build(void* memory, std::uint32_t variant, const Settings& s) noexcept {
    const auto p = physical_config(s);
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
