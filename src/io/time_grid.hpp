// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <resonid/data/record.hpp>
#include <span>
#include <vector>

namespace resonid::io {

/// What the time stamps say about the sampling.
struct TimeGrid {
  double sample_rate_hz = 0.0;
  std::size_t missing = 0;         ///< Samples that the gaps leave out.
  std::vector<std::size_t> index;  ///< Of each stamp on the grid, from 0; empty when they cannot be counted.
  data::Sampling sampling;
};

/// Index of the first time stamp that is not later than the one before it.
[[nodiscard]] std::optional<std::size_t> first_not_rising(std::span<const double> time_s);

[[nodiscard]] double median_interval(std::span<const double> time_s);

/// Fits the uniform grid `t = t0 + k Ts` to rising time stamps by least squares; k counts the samples that
/// gaps leave out. An interval over 1.5 Ts is a gap unless a short neighbour makes up for it (then it is a
/// late or early stamp).
[[nodiscard]] TimeGrid fit_time_grid(std::span<const double> time_s);

}  // namespace resonid::io
