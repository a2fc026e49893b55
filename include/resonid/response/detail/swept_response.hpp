// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/online/lines/detail/sweep.hpp>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

enum class SweptMethod {
  tracker,           ///< One causal pass of the chirp-synchronised filter (Nevaranta 2016, Pub. VI).
  forward_backward,  ///< Mean of a forward and a backward pass: no lag.
  local_cubic,       ///< Local regression of the demodulated signals: no lag, least error; the default.
};

struct SweptConfig {
  online::SweepLaw chirp;  ///< From the record's first sample on; its phase is not needed.
  SweptMethod method = SweptMethod::local_cubic;
  /// Sets the filter's gain, > 0; larger is slower and quieter. Used when pole_radius is 0.
  double lambda = 8.0;
  double pole_radius = 0.0;  ///< Filter's poles, 0 < radius < 1; 0: gain from lambda.
  bool offset_state = true;  ///< Filter with a state for the operating point; the published one has none.
  std::size_t half_width_samples = 0;  ///< Half width w of the local regression; 0: default_half_width().
  bool fit_offset = true;     ///< Local regression takes out a constant and a slope (operating point, drift).
  bool correct_sweep = true;  ///< Local regression: add back the first-order error of the sweep.
  std::vector<double> frequencies_hz;  ///< Grid, inside the sweep; empty: every 0.1 Hz of it.
};

/// Half width in samples over which a chirp sweeps 2.5 Hz on average, but at most a sixth of the sweep and at
/// least 0.2 s: about what modes of some Hz width allow.
[[nodiscard]] std::size_t default_half_width(const online::SweepLaw& chirp, double sample_rate_hz);

/// Lines along a known chirp, one estimate where the sweep passes each frequency.
///
/// Local cubic: with phi(k) the chirp's phase and tau = k - k0, each signal is regressed, with weights
/// (1 - |tau/(w+1)|^3)^3, on cos(phi) tau^i and -sin(phi) tau^i, i = 0 ... 3 (and on 1, tau: an operating
/// point therefore changes nothing). That gives its phasor and two derivatives in time; the quotient's
/// derivatives follow by the quotient rule and, by the law of the sweep, those in frequency. Then
///
///   Y/U = G - j G' (U'/U) wdot - (j/2) G'' wdot      (docs/methods/swept_response.md)
///
/// is solved for G. Ru/U is treated alike. Covariance from the noise spectrum beside the chirp's
/// instantaneous frequency, where the regression does not reach, and the regression's own noise gain.
/// Trackers: the phasors against the chirp, interpolated between the samples beside the frequency (the mean
/// is taken out first when there is an offset state); covariance from the noise beside the chirp in the
/// filter's residuals, and its noise gain. The error of lag and sweep is not in it.
[[nodiscard]] expected<LineEstimates, Error> swept_lines(const data::Record& record,
                                                         const SweptConfig& config, Approach approach);

/// plant_response of swept_lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> swept_response(const data::Record& record,
                                                                      const SweptConfig& config,
                                                                      const ResponseOptions& options);

}  // namespace resonid::response
