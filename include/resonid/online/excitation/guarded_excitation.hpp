// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/enum_names.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/excitation/detail/guarded_excitation_config.hpp>
#include <resonid/online/excitation/detail/oscillation_growth.hpp>
#include <span>
#include <string_view>
#include <type_traits>

namespace resonid::online {

/// Why the injection has ended or is ending.
enum class StopReason {
  none,
  requested,  ///< stop()
  finished,   ///< duration_s
  torque,     ///< Command with excitation.
  velocity,
  position,            ///< Where the machine would come to a stand.
  oscillation,         ///< OscillationGrowth
  signal_lost,         ///< A measurement that a limit needs.
  watchdog_amplitude,  ///< watch()
  watchdog_silent,     ///< watch() is not called any more.
};
inline constexpr EnumName<StopReason> kStopReasonNames[] = {
    {StopReason::none, "none"},
    {StopReason::requested, "requested"},
    {StopReason::finished, "finished"},
    {StopReason::torque, "torque"},
    {StopReason::velocity, "velocity"},
    {StopReason::position, "position"},
    {StopReason::oscillation, "oscillation"},
    {StopReason::signal_lost, "signal-lost"},
    {StopReason::watchdog_amplitude, "watchdog-amplitude"},
    {StopReason::watchdog_silent, "watchdog-silent"}};
[[nodiscard]] constexpr std::span<const EnumName<StopReason>> enum_names(StopReason) noexcept {
  return kStopReasonNames;
}
/// As a clause for a person: "stopped: the torque command came too near to its limit".
[[nodiscard]] std::string_view to_words(StopReason reason) noexcept;
/// Whether a limit stopped it, and not the plan or a request.
[[nodiscard]] constexpr bool is_trip(StopReason reason) noexcept { return reason > StopReason::finished; }

/// What is known of the machine at this sample; NaN: not measured.
template <class Real>
struct MachineSample {
  static constexpr Real kUnknown = std::numeric_limits<Real>::quiet_NaN();
  /// The controller's command of this sample, without excitation; see torque_is_total.
  Real torque = kUnknown;
  Real velocity = kUnknown;
  Real position = kUnknown;
};

/// The first limit that was passed.
template <class Real>
struct StopReport {
  StopReason reason = StopReason::none;
  std::uint64_t sample = 0;  ///< Index of the step that stopped it, 0 for the first.
  Real value = Real(0);  ///< What passed the limit: torque, velocity, place of standstill, rms, s, amplitude.
  Real limit = Real(0);  ///< The level it passed, the margin taken off.
};

/// Injects an excitation into a live machine, and takes it away before the machine comes to harm.
///
///   x(k) = g(k) clip(excitation), kept within the torque that is left        g = (1 - cos(π p))/2
///
/// p rises from 0 to 1 in ramp_in_s, from the first sample on at which every watched quantity has been
/// measured, and falls at the end, on stop(), and in trip_ramp_s when a limit is passed: there are no steps
/// beside those of the excitation, unless trip_ramp_s is 0. With m = margin and T = reaction_s + trip_ramp_s
/// + one sample (and the time since the last measurement), a the largest acceleration, d the deceleration, it
/// stops where
///
///   torque     |torque + x| > m torque_limit; x itself is cut to what is left, so it never is the cause
///   velocity   |v| + a T > m velocity_limit
///   position   p ± (w T + a T²/2 + (w + a T)²/(2 d)) lies outside the window, shrunk by m about its middle
///              (w: velocity towards that end)
///   oscillation, watchdogs, lost signals   as configured
///
/// It only takes the excitation away: a moving machine or an unstable loop has to be stopped by the host, for
/// which tripped() is the signal. What stopped it stays in report() until acknowledge() or reset(). Trivially
/// copyable, no heap. docs/methods/guarded_excitation.md
template <class Real>
class GuardedExcitation {
 public:
  using Scalar = Real;
  using Sample = MachineSample<Real>;

  static expected<GuardedExcitation, Error> create(const GuardedExcitationConfig& config) noexcept {
    if (const auto fault = check(config)) return unexpected<Error>(*fault);
    return GuardedExcitation(config);
  }

  /// What may be injected of `excitation` at this sample. A value that is not finite counts as 0.
  Real step(Real excitation, const Sample& now) noexcept;
  Real step(Real excitation) noexcept { return step(excitation, Sample{}); }
  /// `count` samples went by without step(): nothing was measured. The ramps wait.
  void miss(std::uint64_t count) noexcept;
  /// Newest amplitude of a tracker, for watch_limit and watch_timeout_s; not finite: as if not called.
  void watch(Real amplitude) noexcept;
  /// Ends with the ramp out.
  void stop() noexcept;
  /// After it has stopped, allows the next start, from the beginning; false while it still injects.
  bool acknowledge() noexcept;
  void reset() noexcept;

  [[nodiscard]] const StopReport<Real>& report() const noexcept { return report_; }
  [[nodiscard]] StopReason reason() const noexcept { return report_.reason; }
  [[nodiscard]] bool tripped() const noexcept { return is_trip(report_.reason); }
  /// Nothing is injected any more until acknowledge().
  [[nodiscard]] bool stopped() const noexcept { return reason() != StopReason::none && phase_ == 0; }
  /// Ramp in is over, and nothing has ended it yet: from here to the end the excitation is what it should be.
  [[nodiscard]] bool steady() const noexcept { return reason() == StopReason::none && phase_ == kFull; }
  [[nodiscard]] Real gain() const noexcept { return ramp(phase_); }   ///< g of the newest sample.
  [[nodiscard]] Real injected() const noexcept { return injected_; }  ///< x of the newest sample.
  /// Rms of the oscillation that is watched, and what it is compared with.
  [[nodiscard]] Real oscillation() const noexcept { return growth_.rms(); }
  [[nodiscard]] Real oscillation_threshold() const noexcept { return growth_.threshold(); }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  /// Samples at which a watched quantity was not measured.
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    for (const Measured* signal : {&torque_, &velocity_, &position_})
      if (!intact_flags(signal->watched, signal->seen)) return false;
    return intact_flags(torque_is_total_, oscillation_on_, oscillation_of_torque_, started_) &&
           growth_.intact() && resonid::intact(report_.reason, StopReason::watchdog_silent) &&
           phase_ <= kFull && positive(amplitude_);
  }

 private:
  static constexpr std::uint64_t kFull = std::uint64_t{1} << 62U;

  /// A measured quantity: its newest finite value, and for how many samples there has been none.
  struct Measured {
    Real value = Real(0);
    std::uint64_t age = 0;
    bool watched = false, seen = false;
    void take(Real x) noexcept {
      if (std::isfinite(x)) {
        value = x;
        age = 0;
        seen = true;
      } else {
        ++age;
      }
    }
  };

  explicit GuardedExcitation(const GuardedExcitationConfig& config) noexcept;

  /// Raised cosine of p from 0 to 1.
  static Real ramp(std::uint64_t phase) noexcept {
    if (phase == kFull) return Real(1);
    const Real p = static_cast<Real>(phase) / static_cast<Real>(kFull);
    const Real half = std::sin(Real(0.5) * static_cast<Real>(kPi) * p);  // (1 - cos πp)/2 = sin²(πp/2)
    return half * half;
  }
  [[nodiscard]] bool all_seen() const noexcept {
    return (torque_.seen || !torque_.watched) && (velocity_.seen || !velocity_.watched) &&
           (position_.seen || !position_.watched);
  }
  [[nodiscard]] Real reaction(std::uint64_t age) const noexcept {
    return reaction_s_ + static_cast<Real>(age) * sample_time_s_;
  }
  void measure(const Sample& now) noexcept;
  void look_at_limits() noexcept;
  void look_at_position() noexcept;
  void look_at_signals() noexcept;
  void advance_ramp() noexcept;
  [[nodiscard]] Real within_torque(Real x) noexcept;
  void end(StopReason reason, Real value, Real limit) noexcept;

  Real sample_time_s_, amplitude_, torque_limit_, velocity_limit_, position_low_, position_high_;
  Real deceleration_, acceleration_, reaction_s_, watch_limit_;
  std::uint64_t in_step_, out_step_, trip_step_;      // of the phase, per sample
  std::uint64_t last_full_, learn_, lost_, timeout_;  // samples; 0 of last_full_ and timeout_: no end
  bool torque_is_total_, oscillation_on_, oscillation_of_torque_;
  Measured torque_, velocity_, position_;
  OscillationGrowth<Real> growth_;
  StopReport<Real> report_{};
  Real injected_{};
  std::uint64_t phase_ = 0, samples_ = 0, skipped_ = 0, running_ = 0, silent_ = 0;
  bool started_ = false;
};

}  // namespace resonid::online

#include <resonid/online/excitation/detail/guarded_excitation_impl.hpp>
