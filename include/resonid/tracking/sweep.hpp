// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <resonid/base/constants.hpp>

namespace resonid::tracking {

enum class Sweep { linear, logarithmic };

/// Frequency and phase of a chirp from f0 to f1 in the time T, which stays at f1 from there on (METHOD 3.3).
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
  /// In 2π rad.
  [[nodiscard]] double cycles(double time_s) const noexcept {
    const double t = time_s < duration_s ? time_s : duration_s;
    const double q = std::log(to_hz / from_hz);
    const double swept = sweep == Sweep::linear || q == 0.0
                             ? t * (from_hz + 0.5 * (to_hz - from_hz) * t / duration_s)
                             : from_hz * duration_s / q * std::expm1(q * t / duration_s);
    return swept + to_hz * (time_s - t);
  }
};

}  // namespace resonid::tracking
