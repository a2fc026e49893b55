// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <resonid/base/detail/high_pass.hpp>
#include <resonid/online/excitation/detail/guarded_excitation_config.hpp>

namespace resonid::online {

/// Tells an oscillation that builds itself up from one that the excitation makes.
///
///   r(k) = rms of the signal above from_hz (two high-passes), e(k) = rms of the excitation, over one window
///   known    grown when  r > max(least, growth R)                               R = expected
///   learned  grown when  r > max(least, growth R max(1, e/E))                   R, E = largest r, e so far
///   learning grown when  r > least and q = r/e has risen over two equal times h in a row, by `growth` in
///   all,
///            without slowing down: q2 q0 > 0.85 q1^2, for h of 1/4, 1/2, 1 or 2 windows
///
/// Exponential growth keeps q2 q0 = q1^2; the build-up of a resonance, A (1 - e^{-st}), slows down, and the
/// ramp of the excitation is no growth of q. A resonance that a chirp sweeps over looks like growth: give
/// what it is expected to reach.
template <class Real>
class OscillationGrowth {
 public:
  OscillationGrowth() = default;
  explicit OscillationGrowth(const GuardedExcitationConfig& c) noexcept
      : first_(c.oscillation_from_hz, c.sample_rate_hz),
        second_(c.oscillation_from_hz, c.sample_rate_hz),
        least_(static_cast<Real>(c.oscillation_least)),
        growth_(static_cast<Real>(c.oscillation_growth)),
        expected_(static_cast<Real>(c.oscillation_expected)) {
    const double window_s =
        c.oscillation_window_s > 0.0 ? c.oscillation_window_s : 3.0 / c.oscillation_from_hz;
    const double samples = std::clamp(window_s * c.sample_rate_hz, 1.0, 1e9);
    kept_every_ = std::max<std::uint32_t>(static_cast<std::uint32_t>(samples) / kPerWindow, 1U);
    gain_ = static_cast<Real>(1.0 / samples);
  }

  /// True when the oscillation has grown. `learning`: what is normal is still being learned.
  bool step(Real signal, Real excitation, bool learning) noexcept {
    const Real oscillation = second_.step(first_.step(signal));
    square_ += gain_ * (oscillation * oscillation - square_);
    excitation_square_ += gain_ * (excitation * excitation - excitation_square_);
    if (square_ < kRest) square_ = Real(0);
    if (excitation_square_ < kRest) excitation_square_ = Real(0);
    rms_ = std::sqrt(square_);
    const Real injected = std::sqrt(excitation_square_);
    if (expected_ > Real(0)) return above(growth_ * expected_);
    if (!learning) {
      const Real share = injected > largest_injected_ && largest_injected_ > Real(0)
                             ? injected / largest_injected_
                             : Real(1);
      return above(growth_ * share * largest_);
    }
    largest_ = std::max(largest_, rms_);
    largest_injected_ = std::max(largest_injected_, injected);
    threshold_ = least_;
    if (++since_ < kept_every_) return false;
    since_ = 0;
    newest_ = (newest_ + 1) % kKept;
    ratio_[newest_] = injected > Real(0) ? rms_ / injected : Real(0);
    return rms_ > least_ && (rising(1) || rising(2) || rising(4) || rising(8));
  }
  void reset() noexcept {
    first_.reset();
    second_.reset();
    square_ = excitation_square_ = rms_ = largest_ = largest_injected_ = threshold_ = Real(0);
    ratio_.fill(Real(0));
    since_ = 0;
    newest_ = 0;
  }

  [[nodiscard]] Real rms() const noexcept { return rms_; }
  /// What the rms is compared with now.
  [[nodiscard]] Real threshold() const noexcept { return threshold_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return first_.intact() && second_.intact() && newest_ < kKept;
  }

 private:
  static constexpr Real kRest = Real(1e-30);
  static constexpr Real kSteady = Real(0.85);
  static constexpr std::size_t kKept = 17;        // values of q: over four windows,
  static constexpr std::uint32_t kPerWindow = 4;  // so many in each

  bool above(Real threshold) noexcept {
    threshold_ = std::max(least_, threshold);
    return rms_ > threshold_;
  }
  /// Over twice so many values that were kept.
  [[nodiscard]] bool rising(std::size_t steps) const noexcept {
    const auto ago = [this](std::size_t n) { return ratio_[(newest_ + kKept - n) % kKept]; };
    const Real before = ago(2 * steps), between = ago(steps), now = ago(0);
    return before > Real(0) && between > before && now > between && now >= growth_ * before &&
           now * before > kSteady * between * between;
  }

  HighPass<Real> first_, second_;
  Real least_{}, growth_{}, expected_{}, gain_{};
  Real square_{}, excitation_square_{}, rms_{}, largest_{}, largest_injected_{}, threshold_{};
  std::array<Real, kKept> ratio_{};
  std::size_t newest_ = 0;
  std::uint32_t kept_every_ = 1, since_ = 0;  // samples
};

}  // namespace resonid::online
