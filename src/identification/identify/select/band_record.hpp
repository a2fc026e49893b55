// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <resonid/data/record.hpp>
#include <span>
#include <utility>
#include <vector>

namespace resonid::identification::detail {

/// A record at the rate that a band needs. Input, output, excitation and reference pass the same filters, so
/// that the response between them stays what it was.
struct BandRecord {
  data::Record record;
  std::size_t every = 1;         ///< Samples of the given record per sample of this one; 1: its own rate.
  std::size_t first_sample = 0;  ///< Of the given record.
};

/// Decimated to at least five times the band's upper end by a linear-phase low-pass. With `high_pass`, what
/// lies below the lower end is taken out too (second order, damping ratio 1/sqrt 2, half an octave below it),
/// and the time in which that filter settles. Second output and position are dropped.
[[nodiscard]] BandRecord record_in_band(const data::Record& record, std::pair<double, double> band_hz,
                                        bool high_pass);

/// What lies above a frequency, as that high-pass leaves it; the filter begins at rest on the first sample
/// and has settled after sample_rate_hz/hz samples.
[[nodiscard]] std::vector<double> high_passed(std::span<const double> samples, double hz,
                                              double sample_rate_hz);

/// What lies below one, likewise of second order and begun at rest on the first sample.
[[nodiscard]] std::vector<double> low_passed(std::vector<double> samples, double hz, double sample_rate_hz);

}  // namespace resonid::identification::detail
