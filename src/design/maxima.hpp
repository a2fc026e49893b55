// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <span>
#include <vector>

// Maxima over frequency between lines.
namespace resonid::design {

struct Maximum {
  double frequency_hz = 0.0, value = 0.0;
};

/// values(frequencies_hz, sizes) fills in a function's sizes.
using SizesAt = std::function<void(std::span<const double>, std::span<double>)>;

/// The maximum around three neighbours whose middle one is the largest (at an end of the lines two of them
/// are one), by parabolas through the best three points so far; its value to 1e-12.
[[nodiscard]] Maximum refined_maximum(Maximum left, Maximum top, Maximum right, const SizesAt& sizes_at);

/// All local maxima that exceed `least` on a line, refined; `sizes` are those on the ascending lines.
[[nodiscard]] std::vector<Maximum> maxima_between(std::span<const double> lines_hz,
                                                  std::span<const double> sizes, double least,
                                                  const SizesAt& sizes_at);

/// The largest over all frequencies; lines are taken to be near enough for a maximum to be seen to 3 %.
[[nodiscard]] Maximum largest_between(std::span<const double> lines_hz, std::span<const double> sizes,
                                      const SizesAt& sizes_at);

}  // namespace resonid::design
