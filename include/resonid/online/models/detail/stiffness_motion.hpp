// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <resonid/online/models/discrete_model.hpp>

namespace resonid::online {

/// How a model moves when the stiffness of the machine changes, in plain arithmetic for servo threads.
template <class Real, std::size_t Order>
struct StiffnessDirection {
  DiscreteModel<Real, Order> change{};  ///< Change of b and a per change of ln of the resonance's frequency.
  Real decay = Real(0);                 ///< zeta w of the resonance per sample; 0: nothing oscillates.

  /// A two-mass drive's, with an integrator at z = 1 (a pole near it is taken for one). With
  /// A = (1 - z^-1) D, the zero-order hold of its rigid and its oscillating part is
  ///
  ///   B = z^-1 (r D + s (1 - z^-1)^2)     D = 1 - 2 e^-h cos(v) z^-1 + e^-2h z^-2     s ~ e^-h sin(v)/v
  ///
  /// with h = zeta w, v = w sqrt(1 - zeta^2); masses and damping ratio stay. Nothing for other orders.
  static StiffnessDirection of(const DiscreteModel<Real, Order>& model) noexcept {
    StiffnessDirection d;
    if constexpr (Order == 3) {
      const Real d1 = model.a[0] + Real(1), d2 = d1 + model.a[1];  // the quotient A/(1 - z^-1)
      if (!(d2 > Real(0)) || !(d1 * d1 < Real(4) * d2)) return d;
      const Real radius = std::sqrt(d2);
      const Real h = -std::log(radius), v = std::acos(Real(-0.5) * d1 / radius);
      const Real sine = std::sin(v), cosine = std::cos(v);
      if (!(h > Real(0)) || !(sine > Real(0))) return d;
      const Real rigid = (model.b[0] + model.b[1] + model.b[2]) / (Real(1) + d1 + d2);
      const Real swing = (model.b[0] - rigid) * (v * cosine / sine - h - Real(1));
      const Real by1 = Real(2) * radius * (h * cosine + v * sine), by2 = Real(-2) * h * d2;
      d.change.b = {swing, rigid * by1 - Real(2) * swing, rigid * by2 + swing};
      d.change.a = {by1, by2 - by1, -by2};
      d.decay = h;
    }
    return d;
  }
};

/// By how much the resonance lies beside the estimate that follows it, and what that does to the errors of
/// the equations e = f'(theta(k) - estimate) + noise, with instruments z. Along g, the stiffness' direction,
///
///   moved = sum lambda^i (z'g) e / sum lambda^i (z'g) (f'g)
///
/// of ln of the resonance's frequency: the lag of the estimate. It explains a part of e, which is no noise,
/// (f'g) moved.
template <class Real>
class StiffnessMotion {
 public:
  /// What `moved` so far leaves of the error.
  Real see(Real instrument, Real regressor, Real error, Real factor) noexcept {
    const Real rest = error - moved() * regressor;
    score_ = factor * score_ + instrument * error;
    weight_ = factor * weight_ + instrument * regressor;
    return rest;
  }
  [[nodiscard]] Real moved() const noexcept { return weight_ > kNothing ? score_ / weight_ : Real(0); }
  /// Sum of lambda^i (z'g)(f'g).
  [[nodiscard]] Real weight() const noexcept { return weight_; }
  void flush() noexcept {
    if (std::abs(weight_) < kNothing || !std::isfinite(score_ + weight_)) score_ = weight_ = Real(0);
  }

 private:
  static constexpr Real kNothing = Real(1e-30);
  Real score_ = Real(0), weight_ = Real(0);
};

/// Variance of ln of the resonance's frequency, at the time that an estimate describes, for a motion that it
/// lags behind by `moved`: the oscillation's power fluctuates, and with it the age of what the estimate has
/// seen. With the weights of an exponential memory, the mean age has the relative variance share/2 times the
/// time for which that power is correlated: from 1/decay samples, for one passage through the oscillator, to
/// 2.5 for two without a loop that damps it. `share`: sum of squared weights over the square of their sum.
template <class Real>
[[nodiscard]] Real motion_variance(Real moved, Real share, Real decay) noexcept {
  constexpr Real kCorrelation = Real(1.5);
  if (!(decay > Real(0))) return Real(0);
  return moved * moved * std::min(Real(1), Real(0.5) * share * kCorrelation / decay);
}

/// Adds to the covariance of [b, a] what a motion of this variance along the stiffness' direction brings.
template <class Real, std::size_t Order>
void add_motion(ModelCovariance<Real, Order>& covariance, const StiffnessDirection<Real, Order>& stiffness,
                Real variance) noexcept {
  const auto at = [&](std::size_t i) {
    return i < Order ? stiffness.change.b[i] : stiffness.change.a[i - Order];
  };
  for (std::size_t i = 0; i < 2 * Order; ++i)
    for (std::size_t j = 0; j < 2 * Order; ++j)
      covariance(static_cast<int>(i), static_cast<int>(j)) += variance * at(i) * at(j);
}

}  // namespace resonid::online
