// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/online/models/detail/instrumental_regressors.hpp>
#include <resonid/online/models/discrete_model.hpp>
#include <resonid/online/models/modes.hpp>
#include <span>

namespace resonid::online {

template <std::size_t Order>
struct InstrumentalVariablesConfig {
  DiscreteModel<double, Order> start;  ///< First model; its loop must be stable.
  /// Known controller C, u = C (r - y) + ru, in powers of z^-1; up to order 6.
  std::span<const double> controller_numerator{}, controller_denominator{};
  std::size_t delay_samples = 0;  ///< Known delay of the measured output, whole samples.
  bool refined = true;            ///< Filter by 1/A of the auxiliary model: the noise-optimal instruments.
  EquationTerms terms;            ///< Integrator, load torque, friction, and the basis.
  /// 1/(1 - lambda), > 1; infinite: no forgetting; 0: chosen from the start model.
  double memory_samples = 0.0;
  /// Estimate 2 theta(memory) - theta(2 memory), which has no lag but that of the oscillation: 1.8 times the
  /// variance.
  bool extrapolate = false;
  /// How far the start may be off: standard deviation of each parameter over its typical size, > 0.
  double start_deviation = 0.1;
  /// The same for what is no longer excited: certainty falls down to here, and not further, > 0.
  double largest_deviation = 0.1;
  double noise_rms = 0.0;  ///< Noise of the measured output, for these two; 0: learned.
  std::size_t refresh_samples =
      0;  ///< Between changes of the auxiliary model; 0: chosen from the start model.
};

/// Six periods of the first resonance, and at least five samples per parameter; 100 samples where nothing
/// oscillates.
template <std::size_t Order>
[[nodiscard]] double default_memory_samples(const DiscreteModel<double, Order>& start) noexcept {
  const auto modes = SampledModes<Order>(start, 1.0).resonances();
  return modes.empty() ? 100.0 : std::max(6.0 / modes[0].frequency_hz, 10.0 * Order - 5.0);
}

/// Three periods of the first resonance, at least ten samples: an auxiliary model that changes faster than
/// its own oscillation decays follows the noise, and at many samples per period loses its way.
template <std::size_t Order>
[[nodiscard]] std::size_t default_refresh_samples(const DiscreteModel<double, Order>& start) noexcept {
  const auto modes = SampledModes<Order>(start, 1.0).resonances();
  return modes.empty() ? 10
                       : std::max<std::size_t>(10, static_cast<std::size_t>(3.0 / modes[0].frequency_hz));
}

/// Why a configuration is refused, apart from the controller and the stability of the start's loop.
template <std::size_t Order>
[[nodiscard]] std::optional<Error> fault_of(const InstrumentalVariablesConfig<Order>& c) noexcept {
  for (const auto& coefficients : {c.start.b, c.start.a})
    for (const double x : coefficients)
      if (!std::isfinite(x)) return Error{"start", "must be finite", x};
  if (c.controller_numerator.empty()) return Error{"controller_numerator", "must be given"};
  if (c.controller_denominator.empty()) return Error{"controller_denominator", "must be given"};
  if (c.memory_samples != 0.0 && !(c.memory_samples > 1.0))
    return Error{"memory_samples", "must be > 1, or 0 to choose", c.memory_samples};
  if (!(c.start_deviation > 0.0) || !std::isfinite(c.start_deviation))
    return Error{"start_deviation", "must be > 0", c.start_deviation};
  if (!(c.largest_deviation > 0.0) || !std::isfinite(c.largest_deviation))
    return Error{"largest_deviation", "must be > 0", c.largest_deviation};
  if (!(c.noise_rms >= 0.0) || !std::isfinite(c.noise_rms))
    return Error{"noise_rms", "must be >= 0", c.noise_rms};
  return std::nullopt;
}

}  // namespace resonid::online
