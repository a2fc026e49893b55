// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace resonid::online {

/// Lost samples that an estimator steps through; of more than these the rest is only counted. By then
/// regressors and delay lines, which remember 66 samples, hold nothing that was measured, and predictors and
/// gates have had no input for as long again: what they still do differs from being stepped on, the estimate
/// does not.
inline constexpr std::uint64_t kMostMissedSteps = 128;

/// As `count` steps with samples that are not finite, at most kMostMissedSteps; returns how many were left
/// out.
template <class Estimator>
std::uint64_t step_missed(Estimator& estimator, std::uint64_t count) noexcept {
  constexpr auto kNan = std::numeric_limits<typename Estimator::Scalar>::quiet_NaN();
  const std::uint64_t stepped = std::min(count, kMostMissedSteps);
  for (std::uint64_t i = 0; i < stepped; ++i) estimator.step(kNan, kNan, kNan);
  return count - stepped;
}

}  // namespace resonid::online
