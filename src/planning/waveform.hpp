// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <resonid/planning/detail/crest_factor.hpp>
#include <resonid/planning/detail/power_distribution.hpp>

// Amplitudes and phases of a periodic signal chosen together, for most information per peak.
namespace resonid::planning::detail {

/// Logarithm of a design's criterion, in the dimension of a variance, and its slope by the lines' powers. The
/// slope of e and a with several models is that of each model's own size: near enough to search by.
struct Criterial {
  double log_value = 0.0;
  Eigen::VectorXd slope;
};
[[nodiscard]] Criterial criterial(const DesignProblem& problem, const Eigen::VectorXd& power);

/// A signal in the first period from rest, whose peak counts too: the periodic one plus a transient of few
/// states, shape * weight * [Re X; Im X] in parts of the limit.
struct StartSignal {
  Eigen::Index signal = 0;  ///< Which periodic one.
  Eigen::MatrixXd shape;    ///< [instant, state], kInstantsPerLine * highest harmonic instants of the period.
  Eigen::MatrixXd weight;   ///< [state, 2 lines]
};
inline constexpr std::size_t kInstantsPerLine = 8;  ///< Per period of the highest line.

struct WaveformProblem {
  const DesignProblem* design =
      nullptr;                        ///< Models over all lines, and the criterion; `use` is not looked at.
  std::vector<std::size_t> harmonic;  ///< [line] of the period, ascending.
  std::vector<PeakSignal> signals;    ///< Whose peaks count, at least one.
  std::vector<double> rms_limit;      ///< [signal]; infinite where there is none.
  std::vector<StartSignal> starts;    ///< May be none.
  std::size_t random_starts = 3;
  std::uint64_t seed = 1;
};

struct Waveform {
  std::vector<std::complex<double>> amplitude;  ///< [line] phasors of cosines; largest use of a limit is 1.
  double value = 0.0;                           ///< Criterion of this signal; smaller is better.
};

/// Minimises, over the phasors X_k of all lines, what is left of the criterion when the signal fills its
/// limits:
///
///   log criterion( p_k = |X_k|^2 / 2 ) + 1/q log sum over signals s, instants t of (x_s(t)/limit_s)^2q
///
/// with the periodic signals and those of the start (a drive at rest may need more while it settles),
///
/// by L-BFGS for q = 4, 8 ... 64. A distribution of power alone tends to a few lines, whose crest factor is
/// high; here lines that tell little are used to flatten the peaks, and the signal comes near a square wave
/// of its own. Starts: `power` with optimised phases, and random ones around it.
[[nodiscard]] Waveform optimise_waveform(const WaveformProblem& problem, const Eigen::VectorXd& power);

}  // namespace resonid::planning::detail
