// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace resonid::response {

/// Samples during which a signal is one sine.
struct SineDwell {
  std::size_t first = 0;
  std::size_t samples = 0;
  double frequency_hz = 0.0;
  double share = 0.0;  ///< Of the variance (about a straight line) that the sine explains.

  [[nodiscard]] std::size_t end() const noexcept { return first + samples; }
};

/// The dwells of a signal in which one sine follows another, in the order of time.
///
/// The phase of the analytic signal is then a polygon: it is split where it is furthest from its chord, until
/// it is within 0.25 rad of it (up to 2 rad, where noise bends the phase and this finds more). Each piece of
/// two periods and more is fitted with constant, slope and a sine of unknown frequency, and grows from its
/// middle until two samples in a row miss the fit by four times its scatter. Kept: dwells of three periods
/// and more whose sine explains `least_share` of the variance.
[[nodiscard]] std::vector<SineDwell> sine_dwells(std::span<const double> samples, double sample_rate_hz,
                                                 double least_share);

}  // namespace resonid::response
