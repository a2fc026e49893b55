// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <resonid/response/detail/swept_response.hpp>
#include <span>
#include <vector>

#include "response/signals.hpp"
#include "response/spectra/side_noise.hpp"

namespace resonid::response {

/// A chirp record ready for demodulation.
struct Sweep {
  online::SweepLaw law;
  double sample_time_s = 0.0;
  std::vector<double> phase_rad;     ///< [sample] of the sweep, without the constant
  std::vector<double> cosine, sine;  ///< [sample] of that
  Signals signals;
  std::array<std::vector<double>, 3> values;  ///< excitation, input, output over the sweep; empty when absent

  /// From sample `first` on.
  [[nodiscard]] Carrier carrier(Eigen::Index first) const {
    const auto from = static_cast<std::size_t>(first);
    return {std::span(cosine).subspan(from), std::span(sine).subspan(from)};
  }
};

/// When the sweep passes a frequency.
[[nodiscard]] double time_of(const online::SweepLaw& law, double frequency_hz);

/// The local cubic estimate at one frequency (docs of swept_lines).
[[nodiscard]] LineEstimate local_cubic_line(const Sweep& sweep, const SweptConfig& config, double half_width,
                                            double frequency_hz);

/// Estimates of the chirp-synchronised trackers at the given frequencies (docs of swept_lines).
[[nodiscard]] expected<std::vector<LineEstimate>, Error> tracked_sweep(
    const Sweep& sweep, const SweptConfig& config, const std::vector<double>& frequencies_hz);

}  // namespace resonid::response
