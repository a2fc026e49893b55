// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/measure/line_methods.hpp>
#include <optional>
#include <utility>

namespace resonid::identification::detail {

/// From the first to the last frequency of the widest stretch (of ln f) in which most lines are known; gaps
/// of an anti-resonance's width belong to it. Only lines with power of their own count: next to a strong one
/// a window leaks. Nothing where no line is known.
[[nodiscard]] std::optional<std::pair<double, double>> coherent_band(const response::LineEstimates& lines,
                                                                     const data::FrequencyResponse& response);

/// How much of the frequencies from `low_hz` to `high_hz`, on a logarithmic scale, is coherent: the mean
/// coherence there without what chance gives it, 0 where there is no line.
[[nodiscard]] double coherent_share(const response::LineEstimates& lines, double low_hz, double high_hz);

/// The largest gain of `finer` in mean coherence over any tenth of that scale.
[[nodiscard]] double coherent_gain(const response::LineEstimates& finer,
                                   const response::LineEstimates& coarser, double low_hz, double high_hz);

/// Averaged spectra at the resolution that the answer is worth, in samples per segment.
struct Resolved {
  response::LineEstimates lines;
  std::size_t segment_samples = 0;
  double share = 0.0;                  ///< Its coherent_share().
  double low_hz = 0.0, high_hz = 0.0;  ///< Where any resolution is coherent.
  bool too_coarse = false;             ///< A longer segment would be more coherent still.
};

/// Segments from a quarter of the record downwards: the longest by which most of the band is known to 30 %. A
/// shorter one averages more, and is no longer taken where it loses coherence: then it is too short for what
/// the answer shows, and leaks.
[[nodiscard]] expected<Resolved, Error> resolved_welch_lines(const data::Record& record, const Plan& plan,
                                                             const Options& options);

/// Frequencies for local fits at the resolution of the whole record: every bin at first, then 1 % apart.
[[nodiscard]] std::vector<double> fine_grid(const data::Record& record, double low_hz, double high_hz);

}  // namespace resonid::identification::detail
