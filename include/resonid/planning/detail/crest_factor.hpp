// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <cstdint>
#include <resonid/base/expected.hpp>
#include <vector>

namespace resonid::planning {

/// A signal that the multisine makes somewhere in the drive, and what its peak may be.
struct PeakSignal {
  std::vector<std::complex<double>> gain;  ///< [line], from the multisine to the signal.
  double limit = 1.0;                      ///< Peak values are judged as parts of it, > 0.
};

struct PhaseConfig {
  double sample_rate_hz = 0.0;       ///< Rate of the drive, > 0; lines and rate must have a common period.
  std::vector<double> frequency_hz;  ///< [line], ascending, > 0 and below half the sample rate.
  std::vector<double> amplitude;     ///< [line], or one value for all lines; > 0.
  std::vector<PeakSignal> signals;  ///< Whose largest relative peak is made small; none: the multisine's own.
  std::size_t random_starts = 63;   ///< Beside Schroeder's phases; fewer when there are many lines.
  std::uint64_t seed = 1;           ///< Seed of the random starts.
};

struct OptimisedPhases {
  std::vector<double> phase_rad;  ///< [line], of cosines, 0 ... 2π.
  double crest_factor = 0.0;      ///< Crest factor of the multisine itself, between the samples too.
  double peak = 0.0;              ///< Largest of peak/limit over the signals.
};

/// Phases that make the peaks of a multisine small:
///
///   minimise over p_k:  sum over signals s and instants t of |x_s(t)/limit_s|^2q,   q = 2, 4, 8 ... 256,
///   x_s(t) = sum_k A_k Re( g_sk e^{j(2π f_k t + p_k)} )
///
/// by Levenberg-Marquardt for rising q (L_2q tends to the peak), from Schroeder's and from random phases. The
/// best of all starts is given; the same configuration gives the same phases. Peaks are taken on a grid of 48
/// points per period of the highest line. 21 flat lines come to a crest factor of 1.42; very few lines stay
/// higher (3: 1.62). Source: Guillaume et al. 1991.
[[nodiscard]] expected<OptimisedPhases, Error> optimise_phases(const PhaseConfig& config);

}  // namespace resonid::planning
