// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <new>
#include <resonid/base/expected.hpp>
#include <resonid/online/axis_config.hpp>
#include <resonid/online/axis_result.hpp>
#include <resonid/online/detail/axis_reading.hpp>
#include <resonid/online/models/physical_tracker.hpp>
#include <string_view>

namespace resonid::online::detail {

/// Sampled model of a two-mass drive: exact zero-order hold.
[[nodiscard]] AxisReading::Model sampled_two_mass(const std::array<double, 5>& j1_j2_k_d_b,
                                                  double sample_rate_hz) noexcept;
/// Its covariance from that of ln J1, ln J2, ln K, ln D and B, by central differences: the hold is smooth.
[[nodiscard]] AxisReading::Covariance sampled_two_mass_covariance(
    const std::array<double, 5>& j1_j2_k_d_b, const Eigen::Matrix<double, 5, 5>& covariance,
    double sample_rate_hz) noexcept;

/// PhysicalTracker as an axis runs it.
template <class Real, std::size_t ReplaySamples>
class AxisPhysical {
 public:
  using Scalar = Real;
  using Tracker = PhysicalTracker<Real, ReplaySamples>;
  static constexpr bool kTakesVelocity = true;

  static bool serves(const AxisConfig& c) noexcept { return c.method == AxisMethod::physical; }
  static expected<void, Error> create_in(void* where, const AxisConfig& c) noexcept {
    PhysicalTrackerConfig p = c.physical;
    p.sample_rate_hz = c.sample_rate_hz;
    p.delay_s = c.known_delay_s + (c.output == AxisOutput::position ? 0.5 / c.sample_rate_hz : 0.0);
    const auto tracker = Tracker::create(p);
    if (!tracker) return unexpected<Error>(tracker.error());
    ::new (where) AxisPhysical(*tracker, c.sample_rate_hz);
    return {};
  }

  void step(Real ru, Real u, Real y) noexcept { tracker_.step(ru, u, y); }
  void miss(std::uint64_t count) noexcept { tracker_.miss(count); }
  void reset() noexcept { tracker_.reset(); }
  [[nodiscard]] Real residual() const noexcept {
    return tracker_.ready() ? tracker_.residual() : std::numeric_limits<Real>::quiet_NaN();
  }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return tracker_.skipped_samples(); }

  void read(AxisReading& r, const AxisCriteria& criteria) noexcept {
    r.ready = tracker_.ready();
    r.excited = tracker_.excited();
    r.physical = tracker_.plausible();
    r.has_model = true;
    r.lag_samples = tracker_.lag_samples();
    for (std::size_t i = 0; i < kReported.size(); ++i)
      r.parameter[i] = {tracker_.value(kReported[i]), tracker_.standard_deviation(kReported[i])};
    r.resonance_hz = {tracker_.resonance_hz(), tracker_.resonance_std_hz()};
    r.antiresonance_hz = {tracker_.antiresonance_hz(), tracker_.antiresonance_std_hz()};
    using P = PhysicalParameter;
    const double j1 = tracker_.value(P::driven_inertia), j2 = tracker_.value(P::load_inertia);
    const double k = tracker_.value(P::stiffness), d = tracker_.value(P::damping);
    r.driven_inertia = j1;
    r.load_inertia = j2;
    r.stiffness = k;
    r.resonance_damping = 0.5 * d / k * kTwoPi * r.resonance_hz.value;
    r.antiresonance_damping = 0.5 * d / k * kTwoPi * r.antiresonance_hz.value;
    r.uncertainty = r.resonance_hz.std / r.resonance_hz.value;
    r.most_uncertainty = criteria.resonance_std;
    const std::array<double, 5> plant{j1, j2, k, d, tracker_.value(P::viscous_friction)};
    r.model = sampled_two_mass(plant, sample_rate_hz_);
    if (!r.wants_covariance) return;
    constexpr std::array kOfPlant = {P::driven_inertia, P::load_inertia, P::stiffness, P::damping,
                                     P::viscous_friction};
    const auto all = tracker_.log_covariance();
    Eigen::Matrix<double, 5, 5> covariance;
    for (int i = 0; i < 5; ++i)
      for (int j = 0; j < 5; ++j)
        covariance(i, j) = static_cast<double>(all(static_cast<int>(kOfPlant[static_cast<std::size_t>(i)]),
                                                   static_cast<int>(kOfPlant[static_cast<std::size_t>(j)])));
    r.set_covariance(sampled_two_mass_covariance(plant, covariance, sample_rate_hz_));
  }
  void watch(AxisStability&) const noexcept {}
  void set_stiffness_drift(double per_s) noexcept { tracker_.set_stiffness_drift(per_s); }
  [[nodiscard]] std::string_view parameter_name(std::size_t i) const noexcept {
    constexpr std::string_view kNames[] = {"driven_inertia", "load_inertia",     "stiffness",       "damping",
                                           "torque_offset",  "viscous_friction", "coulomb_friction"};
    return i < kReported.size() ? kNames[i] : std::string_view{};
  }
  [[nodiscard]] bool white_residual() const noexcept { return true; }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return tracker_.intact(); }
  [[nodiscard]] Tracker& tracker() noexcept { return tracker_; }
  [[nodiscard]] const Tracker& tracker() const noexcept { return tracker_; }

 private:
  static constexpr std::array kReported = {
      PhysicalParameter::driven_inertia,  PhysicalParameter::load_inertia,
      PhysicalParameter::stiffness,       PhysicalParameter::damping,
      PhysicalParameter::torque_offset,   PhysicalParameter::viscous_friction,
      PhysicalParameter::coulomb_friction};

  AxisPhysical(const Tracker& tracker, double sample_rate_hz) noexcept
      : tracker_(tracker), sample_rate_hz_(sample_rate_hz) {}

  Tracker tracker_;
  double sample_rate_hz_;
};

}  // namespace resonid::online::detail
