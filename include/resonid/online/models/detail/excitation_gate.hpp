// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <resonid/base/detail/flushed.hpp>

namespace resonid::online {

/// Tells within a few samples that an excitation has ended: the rms of its last samples against the largest
/// such rms so far. Estimators hold meanwhile what they know, since noise alone would lead them astray.
template <class Real>
class ExcitationGate {
 public:
  /// `least_share` of the largest rms, 0 ... 1; 0 never closes.
  explicit ExcitationGate(double least_share = 0.0) noexcept
      : least_square_(static_cast<Real>(least_share * least_share)) {}

  void step(Real x) noexcept {
    fade_ = fade_ > Real(1e-9) ? fade_ * kKeep : Real(0);
    // A spike, which would be the largest for ever, counts for no more than it takes to follow a rise.
    const Real power = largest_ > Real(0) ? std::min(x * x, kSteepest * largest_) : x * x;
    square_ = flushed(kKeep * square_ + (Real(1) - kKeep) * power);
    largest_ = std::max(largest_, square_ / (Real(1) - fade_));
  }
  void reset() noexcept {
    square_ = largest_ = Real(0);
    fade_ = Real(1);
  }
  /// Whether there is excitation.
  [[nodiscard]] bool open() const noexcept {
    return least_square_ == Real(0) || square_ > least_square_ * largest_ * (Real(1) - fade_);
  }
  [[nodiscard]] bool seen() const noexcept { return largest_ > Real(0); }

 private:
  static constexpr Real kKeep = Real(15.0 / 16.0);
  static constexpr Real kSteepest = Real(16);
  Real least_square_;
  Real square_ = Real(0), largest_ = Real(0);
  Real fade_ = Real(1);  // weight of the zeros before the first sample
};

/// The gate on ru as soon as there is any, else on the input u.
template <class Real>
class InputGate {
 public:
  explicit InputGate(double least_share = 0.0) noexcept : excitation_(least_share), input_(least_share) {}
  void step(Real ru, Real u) noexcept {
    if (std::isfinite(ru)) excitation_.step(ru);
    input_.step(u);
  }
  void reset() noexcept {
    excitation_.reset();
    input_.reset();
  }
  [[nodiscard]] bool open() const noexcept { return excitation_.seen() ? excitation_.open() : input_.open(); }

 private:
  ExcitationGate<Real> excitation_, input_;
};

}  // namespace resonid::online
