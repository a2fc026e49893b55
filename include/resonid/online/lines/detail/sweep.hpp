// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/intact.hpp>
#include <resonid/online/excitation/detail/sweep.hpp>
#include <resonid/online/lines/detail/line_phase.hpp>

namespace resonid::online {

/// Frequency and phase of a chirp from f0 to f1 in the time T, which stays at f1 from there on.
///
///   linear:       f = f0 + m t,        phase = 2π (f0 t + m t²/2),           m = (f1 - f0)/T
///   logarithmic:  f = f0 e^{q t/T},    phase = 2π f0 T/q (e^{q t/T} - 1),    q = ln(f1/f0)
struct SweepLaw {
  double from_hz = 0.0;
  double to_hz = 0.0;
  double duration_s = 0.0;
  Sweep sweep = Sweep::linear;

  [[nodiscard]] double frequency_hz(double time_s) const noexcept {
    if (time_s >= duration_s) return to_hz;
    const double part = time_s / duration_s;
    if (sweep == Sweep::linear) return from_hz + (to_hz - from_hz) * part;
    return from_hz * std::exp(std::log(to_hz / from_hz) * part);
  }
  /// Sum of frequency_hz(k Ts) Ts over k = first ... first + count - 1, in 2π rad and less whole turns: how
  /// far a phasor turns that is turned on at every sample.
  [[nodiscard]] double turns_over(std::uint64_t first, std::uint64_t count,
                                  double sample_time_s) const noexcept {
    const double end = std::ceil(duration_s / sample_time_s);
    const double begin = static_cast<double>(first);
    const auto swept = static_cast<std::uint64_t>(
        std::min(std::max(end - begin, 0.0), static_cast<double>(count)));  // samples before the end
    const double n = static_cast<double>(swept);
    const double q = std::log(to_hz / from_hz) * sample_time_s / duration_s;  // per sample
    double turns = 0.0;
    if (sweep == Sweep::linear || q == 0.0)
      turns = n * sample_time_s *
              (from_hz + (to_hz - from_hz) / duration_s * sample_time_s * (begin + 0.5 * (n - 1.0)));
    else
      turns = from_hz * std::exp(q * begin) * sample_time_s * std::expm1(n * q) / std::expm1(q);
    turns -= std::floor(turns);
    return turns + std::arg(LinePhase(to_hz * sample_time_s).forth_to(count - swept)) / kTwoPi;
  }
  /// In 2π rad.
  [[nodiscard]] double cycles(double time_s) const noexcept {
    const double t = time_s < duration_s ? time_s : duration_s;
    const double q = std::log(to_hz / from_hz);
    const double swept = sweep == Sweep::linear || q == 0.0
                             ? t * (from_hz + 0.5 * (to_hz - from_hz) * t / duration_s)
                             : from_hz * duration_s / q * std::expm1(q * t / duration_s);
    return swept + to_hz * (time_s - t);
  }
  /// For a state of unknown origin (base/detail/intact.hpp): frequencies lie between the two ends.
  [[nodiscard]] bool intact() const noexcept {
    return positive(from_hz) && positive(to_hz) && positive(to_hz / from_hz) && positive(duration_s) &&
           resonid::intact(sweep, Sweep::logarithmic);
  }
};

}  // namespace resonid::online
