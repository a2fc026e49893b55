// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/response/line_estimates.hpp>

namespace resonid::response {

struct WelchConfig {
  std::size_t segment_samples = 0;  ///< Samples per segment, >= 16; 0: default_segment().
  double overlap = 0.5;             ///< Share of a segment that the next one repeats, 0 <= overlap < 1.
  std::size_t period_samples =
      0;                      ///< > 0: the excitation repeats so. Segments are single periods, no window.
  double band_low_hz = 0.0;   ///< Lowest line, >= 0 (0 Hz itself is never reported).
  double band_high_hz = 0.0;  ///< Highest line; 0: half the sample rate.
};

/// Power of two nearest to an eighth of the record (so 10 ... 22 half-overlapping segments), but no longer
/// than a resolution of 0.1 Hz takes and no shorter than 64 samples.
[[nodiscard]] std::size_t default_segment(std::size_t samples, double sample_rate_hz);

/// How many independent averages K overlapping segments are worth (Welch 1967):
///
///   K / (1 + 2 sum_j (1 - j/K) rho_j),   rho_j = (sum_n w(n) w(n + j D))^2 / (sum_n w(n)^2)^2
///
/// D: hop. Half-overlapping Hann segments: rho_1 = 1/36, 0.947 K.
[[nodiscard]] double equivalent_averages(const std::vector<double>& window, std::size_t hop,
                                         std::size_t segments);

/// Lines by averaged spectra of Hann-windowed overlapping segments (Welch 1967). Each signal is referred to
/// the reference R (input for direct, else excitation): X = S_xr/sqrt(S_rr), so Y/U is S_yu/S_uu (direct) or
/// S_yru/S_uru (joint), and Y/Ru is S_yru/S_ruru. Covariance from what the reference does not explain,
/// (S_xx - S_xr S_rx/S_rr)/(n - 1) with n equivalent averages.
/// The correlation of neighbouring lines and the smoothing by the window (its width is 1/sqrt(3) of the line
/// spacing) go with the lines, for fits to them.
/// Limits: leakage biases sharp resonances until the segment lasts several 1/(zeta w); direct is biased under
/// feedback when the noise is not small. Needs at least two segments.
[[nodiscard]] expected<LineEstimates, Error> welch_lines(const data::Record& record,
                                                         const WelchConfig& config, Approach approach);

/// plant_response of welch_lines.
[[nodiscard]] expected<data::FrequencyResponse, Error> welch(const data::Record& record,
                                                             const WelchConfig& config,
                                                             const ResponseOptions& options);

}  // namespace resonid::response
