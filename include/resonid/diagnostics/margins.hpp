// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/frequency_response.hpp>
#include <resonid/online/supervision/loop_margins.hpp>
#include <vector>

namespace resonid::diagnostics {

/// A downward crossing of |L| = 1.
struct Crossover {
  double frequency_hz = 0.0;
  double phase_margin_deg = 0.0;  ///< 180 + arg L in (-180, 180]; negative: the loop encircles -1 there.
};

/// Stability margins read off the Nyquist curve of the real loop L = C Gd, every known delay included
/// (Astrom and Murray 2008, 9.3; Nevaranta 2016, Pub. VI). What the band does not show is absent.
struct LoopMargins {
  std::vector<Crossover> crossovers;  ///< In ascending frequency; empty: |L| does not cross 1 downwards.
  std::optional<double> worst_phase_margin_deg;  ///< Smallest over all crossings of |L| = 1, upward ones too.
  double modulus_margin = 0.0;                   ///< min |1 + L| over the whole band.
  double modulus_margin_hz = 0.0;                ///< Where that is.
  std::optional<double> gain_margin_db;          ///< Smallest factor > 1 at arg L = -180 deg, in dB.
  std::optional<double> gain_margin_hz;

  [[nodiscard]] std::optional<double> crossover_hz() const;
  [[nodiscard]] std::optional<double> phase_margin_deg() const;  ///< At the first crossover.
};

/// Margins of a loop response given at ascending frequencies; between lines |L| and |1 + L| are interpolated
/// (log |L|, arg L and the distance to -1 on the chord). Needs at least 2 lines; fewer give no margins
/// (absent, and a modulus margin of the one line).
[[nodiscard]] LoopMargins loop_margins(const data::FrequencyResponse& loop);

/// Resonance and anti-resonance by the source's Nyquist rules (running_resonance()); grid values.
struct NyquistResonance {
  std::optional<double> antiresonance_hz;
  std::optional<double> resonance_hz;
};
[[nodiscard]] NyquistResonance nyquist_resonance(const data::FrequencyResponse& loop);

}  // namespace resonid::diagnostics
