// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

#include "monitor/samples/ring.hpp"
#include "monitoring/axis_spec.hpp"

namespace resonid::monitor {

/// gamma^2 between what excites an axis (ru where it has one, else u) and its output, over frequency.
struct CoherenceSpectrum {
  double spacing_hz = 0.0;
  double averages = 0.0;      ///< How many independent ones went in (response::equivalent_averages).
  std::vector<double> value;  ///< [bin]; not a number: nothing excites it. Empty: not known.
};

/// Columns beside the frequencies of a curve; empty: not known.
struct CoherenceColumns {
  std::vector<double> value, std;
};

/// A power of two with which bins lie no farther apart than the lowest frequency and the closest pair of few
/// ones (lines), 256 ... 8192.
[[nodiscard]] std::size_t coherence_segment(const std::vector<double>& frequency_hz, double sample_rate_hz);

/// By response::welch_lines over the newest 32 half-overlapping segments of the ring, of those stretches in
/// which no sample is missing; empty with fewer than 8. Any thread may call it.
/// Limits: n averages of incoherent signals give 1/n; delays and resonances as long as a segment lower it.
[[nodiscard]] CoherenceSpectrum measured_coherence(const Ring& ring, const monitoring::AxisSpec& spec,
                                                   std::size_t segment_samples);

/// At the bins nearest to the frequencies. std(gamma^2) = sqrt(2/n) gamma (1 - gamma^2) (Bendat and Piersol,
/// Random Data, chapter 9).
[[nodiscard]] CoherenceColumns coherence_at(const CoherenceSpectrum& spectrum,
                                            const std::vector<double>& frequency_hz);

/// measured_coherence() of one axis, made anew once a second at most, and only when somebody asks. For any
/// threads but those on the samples' way: they wait for one another.
class MeasuredCoherence {
 public:
  [[nodiscard]] CoherenceColumns at(const Ring& ring, const monitoring::AxisSpec& spec,
                                    const std::vector<double>& frequency_hz);

 private:
  std::mutex mutex_;
  CoherenceSpectrum spectrum_;
  std::size_t segment_ = 0;
  std::optional<std::uint64_t> end_;  ///< Of the ring, as the spectrum has it.
  std::chrono::steady_clock::time_point made_;
};

}  // namespace resonid::monitor
