// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace resonid::io {

/// What a position may wrap around at.
struct WrapRanges {
  std::vector<double> known = {};  ///< Whole turns, counts per turn ..., in the unit of the values.
  bool counts = false;             ///< Also at 2^8 ... 2^32.
  bool any = false;                ///< Also at what its jumps show, if they agree.
};

struct Unwrapped {
  std::size_t jumps = 0;
  double range = 0.0;
  bool estimated = false;  ///< Found from the jumps.
  bool whole = false;      ///< All values were whole numbers.
};

/// Undoes the wrap-around of a position that jumps by a whole range between samples that otherwise differ
/// little. Every jump shows the range: the jump less the slope beside it,
///
///   M_k = |x_k - x_{k-1} - (slope before + slope after) / 2|
///
/// with the scatter that the same formula has where nothing jumps. The range is one that is known, or, of at
/// least two jumps that agree in a signal that fills the range, the roundest number (a power of two, else the
/// one with most zeros at its end) within three standard deviations of their mean.
///
/// @param at numbers of the samples, where some are missing; empty: one behind the other
/// @return how often it jumped, and by how much; nothing where it does not jump or its jumps do not agree
[[nodiscard]] std::optional<Unwrapped> unwrap(std::vector<double>& values, std::span<const std::size_t> at,
                                              const WrapRanges& ranges);

}  // namespace resonid::io
