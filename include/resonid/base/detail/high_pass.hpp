// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/flushed.hpp>
#include <resonid/base/detail/intact.hpp>

namespace resonid {

/// First-order high-pass (1 + p)/2 (1 - z^-1)/(1 - p z^-1), settled on its first sample. It comes to rest at
/// last, instead of fading into slow denormal numbers.
template <class Real>
class HighPass {
 public:
  HighPass() = default;
  HighPass(double corner_hz, double sample_rate_hz) noexcept
      : on_(corner_hz > 0.0), pole_(static_cast<Real>(std::exp(-kTwoPi * corner_hz / sample_rate_hz))) {}
  Real step(Real x) noexcept {
    if (!on_) return x;
    if (!started_) last_ = x;
    started_ = true;
    output_ = flushed_signal(Real(0.5) * (Real(1) + pole_) * (x - last_) + pole_ * output_);
    last_ = x;
    return output_;
  }
  void reset() noexcept {
    started_ = false;
    last_ = output_ = Real(0);
  }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept { return intact_flags(on_, started_); }

 private:
  bool on_ = false, started_ = false;
  Real pole_ = Real(0), last_ = Real(0), output_ = Real(0);
};

}  // namespace resonid
