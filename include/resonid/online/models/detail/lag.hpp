// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>
#include <resonid/online/models/rls.hpp>

namespace resonid::online {

/// How long an oscillator goes on ringing as it was while the machine changes already: 0.7/(zeta w) of the
/// first resonance, in samples; 0 where nothing oscillates. Measured on the tooth belt (docs/methods).
template <class Real, std::size_t Order>
[[nodiscard]] double oscillation_memory_samples(const DiscreteModel<Real, Order>& model) noexcept {
  constexpr double kShare = 0.7, kMost = 1000.0;
  double slowest = 0.0;
  const SampledModes<Order> modes(model, 1.0);
  for (const std::complex<double>& z : modes.poles())
    if (z.imag() > 0.0)
      slowest = std::max(slowest, std::abs(z) < 1.0 ? -kShare / std::log(std::abs(z)) : kMost);
  return std::min(slowest, kMost);
}

/// Whether the start no longer matters: as many samples as parameters have been seen ten times over, or the
/// memory three times, whichever takes longer.
template <class Real, std::size_t Parameters, class Factors>
[[nodiscard]] bool started(const RecursiveLeastSquares<Real, Parameters, Factors>& rls) noexcept {
  const double used = static_cast<double>(rls.samples() - rls.skipped_samples());
  const double memory = rls.factor() < Real(1) ? 3.0 / (1.0 - static_cast<double>(rls.factor())) : 0.0;
  return used >= std::max(10.0 * static_cast<double>(Parameters), memory);
}

}  // namespace resonid::online
