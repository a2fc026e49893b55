// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/base/constants.hpp>
#include <resonid/recursive/modes.hpp>

namespace resonid::recursive {

/// By how much the machine's own oscillation delays what its response shows of a changing machine, in
/// samples: 0.7/(zeta w_res) of the model. 0 where the model has no damped oscillation.
///
/// A pole p that moves adds -(1/(jw - p)) times the rate to the response at w: a delay 1/(jw - p), real part
/// 1/(zeta w_res) at the resonance and less beside it. Its mean over dense lines, weighted by how much each
/// tells about p, |jw - p|^-4, is exactly 0.75/(zeta w_res); with lines as far apart as the resonance is
/// wide, and the other coefficients free, 0.6 ... 0.7 is what is seen
/// (docs/methods/recursive_response_fit.md).
template <class Real, std::size_t Order>
[[nodiscard]] double oscillation_lag_samples(const DiscreteModel<Real, Order>& model,
                                             double sample_rate_hz) noexcept {
  constexpr double kPart = 0.7;
  const auto modes = SampledModes<Order>(model, sample_rate_hz).resonances();
  if (modes.empty()) return 0.0;
  const double decay_1_s = modes[0].damping_ratio * kTwoPi * modes[0].frequency_hz;
  return decay_1_s > 0.0 ? kPart * sample_rate_hz / decay_1_s : 0.0;
}

}  // namespace resonid::recursive
