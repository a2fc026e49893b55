// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <complex>
#include <cstddef>
#include <resonid/base/approach.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <span>
#include <vector>

#include "reproduce/vi_experiment.hpp"

namespace resonid::reproduction::vi {

/// Frequency that turns the filter: the chirp's own, f0 + m t, or the printed f(t) = f0 + m t/2.
enum class FilterFrequency { instantaneous, printed };

/// The published estimator: one two-state filter of fixed gain on each of ru, u and y, in one pass, without a
/// state for the operating point (Nevaranta 2016, Pub. VI, eqs. 7-8, 12-18). The phasors of
/// online::ChirpTracker at every sample, referred to the chirp's own phase.
class TrackedSweep {
 public:
  enum Signal : std::size_t { kExcitation, kInput, kOutput };

  TrackedSweep(const data::Record& record, const Known& known, double lambda,
               FilterFrequency frequency = FilterFrequency::instantaneous);

  /// The response where the sweep passes each frequency, linear between samples, known delay taken out
  /// (eqs. 19-21; indirect: eq. 5). Read `lag_samples` later, where the filter has come after the sweep.
  [[nodiscard]] data::FrequencyResponse response(std::span<const double> frequencies_hz, Approach approach,
                                                 double lag_samples = 0.0) const;

  /// z(k) - H x(k), the newest sample minus what was predicted for it (Figure 3 c-e).
  [[nodiscard]] const std::vector<double>& residual(Signal signal) const { return residual_[signal]; }

 private:
  [[nodiscard]] std::complex<double> phasor(Signal signal, double position) const;

  Known known_;
  double sample_rate_hz_ = 0.0;
  std::array<std::vector<std::complex<double>>, 3> phasor_;
  std::array<std::vector<double>, 3> residual_;
};

/// How far a response is from the truth at the same frequencies.
struct ResponseErrors {
  double decibel = 0.0;  ///< Largest error of the magnitude.
  double degree = 0.0;   ///< Largest error of the phase.
  double rms = 0.0;      ///< Root mean square of |G/truth - 1|.
  double decibel_above_5hz = 0.0;
  double degree_above_5hz = 0.0;
  double rms_above_5hz = 0.0;
};
[[nodiscard]] ResponseErrors errors(const data::FrequencyResponse& found,
                                    const data::FrequencyResponse& truth);

}  // namespace resonid::reproduction::vi
