// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <resonid/base/high_pass.hpp>
#include <resonid/excitation/guarded_excitation_config.hpp>

namespace resonid::excitation {

/// Tells an oscillation that builds itself up from one that the excitation makes.
///
///   r(k) = rms of the signal above from_hz (two high-passes), e(k) = rms of the excitation, over one window
///   known    grown when  r > max(least, growth R)                               R = expected
///   learned  grown when  r > max(least, growth R max(1, e/E))                   R, E = largest r, e so far
///   learning grown when  r > least and q = r/e has risen over each of the last four windows, by `growth` in
///            all, without slowing down: q4 q0 > 0.75 q2^2
///
/// Exponential growth keeps q4 q0 = q2^2; the build-up of a resonance, A (1 - e^{-st}), slows down, and the
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
    window_ = static_cast<std::uint32_t>(std::clamp(window_s * c.sample_rate_hz, 1.0, 1e9));
    gain_ = Real(1) / static_cast<Real>(window_);
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
    if (++since_ < window_) return false;
    since_ = 0;
    for (std::size_t i = 0; i + 1 < ratio_.size(); ++i) ratio_[i] = ratio_[i + 1];
    ratio_.back() = injected > Real(0) ? rms_ / injected : Real(0);
    return rms_ > least_ && rising();
  }
  void reset() noexcept {
    first_.reset();
    second_.reset();
    square_ = excitation_square_ = rms_ = largest_ = largest_injected_ = threshold_ = Real(0);
    ratio_.fill(Real(0));
    since_ = 0;
  }

  [[nodiscard]] Real rms() const noexcept { return rms_; }
  /// What the rms is held against now.
  [[nodiscard]] Real threshold() const noexcept { return threshold_; }

 private:
  static constexpr Real kRest = Real(1e-30);
  static constexpr Real kSteady = Real(0.75);

  bool above(Real threshold) noexcept {
    threshold_ = std::max(least_, threshold);
    return rms_ > threshold_;
  }
  [[nodiscard]] bool rising() const noexcept {
    if (!(ratio_[0] > Real(0)) || ratio_[4] < growth_ * ratio_[0]) return false;
    for (std::size_t i = 0; i + 1 < ratio_.size(); ++i)
      if (!(ratio_[i + 1] > ratio_[i])) return false;
    return ratio_[4] * ratio_[0] > kSteady * ratio_[2] * ratio_[2];
  }

  HighPass<Real> first_, second_;
  Real least_{}, growth_{}, expected_{}, gain_{};
  Real square_{}, excitation_square_{}, rms_{}, largest_{}, largest_injected_{}, threshold_{};
  std::array<Real, 5> ratio_{};  // q at the ends of the last windows, newest last
  std::uint32_t window_ = 1, since_ = 0;
};

}  // namespace resonid::excitation
