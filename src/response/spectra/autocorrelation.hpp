// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <optional>
#include <span>

namespace resonid::response {

struct Repetition {
  std::size_t lag = 0;
  double correlation = 0.0;  ///< Highest of the normalised autocorrelation, 0.9 ... 1.
};

/// The lag after which samples repeat: the first peak of the normalised autocorrelation, after it was below
/// 0.5, that comes within 0.5 % of the highest one; nothing when that is below 0.9.
[[nodiscard]] std::optional<Repetition> repetition_of(std::span<const double> samples);

}  // namespace resonid::response
