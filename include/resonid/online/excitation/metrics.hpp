// SPDX-License-Identifier: MIT
#pragma once

#include <span>

namespace resonid::online {

/// What an excitation asks of the drive, in the unit of the samples.
struct Metrics {
  double rms = 0.0;
  double peak = 0.0;          ///< Largest magnitude.
  double crest_factor = 0.0;  ///< peak / rms; 0 when the signal is 0.
};

/// Over all samples: for a periodic excitation, hand over whole periods.
[[nodiscard]] Metrics measure(std::span<const double> samples) noexcept;

/// Frequencies that an excitation reaches.
struct Band {
  double low_hz = 0.0;
  double high_hz = 0.0;
};

}  // namespace resonid::online
