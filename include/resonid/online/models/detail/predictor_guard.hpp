// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <resonid/base/detail/flushed.hpp>
#include <resonid/online/models/detail/model_response.hpp>

namespace resonid::online {

/// Keeps the simulated output of an output-error estimator from running away.
///
/// A step of the parameters that would put a pole outside of |z| = radius is shortened until it does not, to
/// nothing if need be. A prediction that is off by kFar times the largest rms of the output is lost all the
/// same: the estimator then starts it anew from what was measured.
template <class Real>
class PredictorGuard {
 public:
  explicit PredictorGuard(double largest_pole_radius = 1.0) noexcept
      : radius_(static_cast<Real>(largest_pole_radius)) {}

  template <class Rls, class Past>
  void keep_stable(Rls& rls, const Past& past, const typename Rls::Vector& before) noexcept {
    if (poles_within(past.model(rls.parameters()), radius_)) return;
    ++shortened_;
    const typename Rls::Vector after = rls.parameters();
    for (Real share = Real(0.5); share > Real(0.1); share *= Real(0.5)) {
      typename Rls::Vector theta = before;
      for (std::size_t i = 0; i < theta.size(); ++i) theta[i] += share * (after[i] - before[i]);
      if (!poles_within(past.model(theta), radius_)) continue;
      rls.set_parameters(theta);
      return;
    }
    rls.set_parameters(before);
  }

  /// Whether the prediction of y is lost.
  bool lost(Real y, Real predicted) noexcept {
    fade_ = fade_ > Real(1e-9) ? fade_ * kKeep : Real(0);
    square_ = flushed(kKeep * square_ + (Real(1) - kKeep) * y * y);
    largest_ = std::max(largest_, square_ / (Real(1) - fade_));
    const Real error = y - predicted;
    if (error * error <= kFar * kFar * largest_) return false;
    ++restarts_;
    return true;
  }
  void reset() noexcept { *this = PredictorGuard(static_cast<double>(radius_)); }

  [[nodiscard]] std::uint64_t shortened() const noexcept { return shortened_; }
  [[nodiscard]] std::uint64_t restarts() const noexcept { return restarts_; }

 private:
  static constexpr Real kFar = Real(10);
  static constexpr Real kKeep = Real(31.0 / 32.0);
  Real radius_;
  Real square_ = Real(0), largest_ = Real(0), fade_ = Real(1);
  std::uint64_t shortened_ = 0, restarts_ = 0;
};

}  // namespace resonid::online
