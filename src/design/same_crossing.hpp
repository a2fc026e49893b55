// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <vector>

namespace resonid::design {

/// The one of the same direction that is nearest in the logarithm of frequency.
template <class Crossing, class As>
[[nodiscard]] const Crossing* nearest_crossing(const std::vector<Crossing>& crossings, const As& as) {
  const Crossing* nearest = nullptr;
  const auto away = [&](const Crossing& c) { return std::abs(std::log(c.frequency_hz / as.frequency_hz)); };
  for (const auto& crossing : crossings)
    if (crossing.falling == as.falling && (nearest == nullptr || away(crossing) < away(*nearest)))
      nearest = &crossing;
  return nearest;
}

/// The crossing of |L| = 1 of another loop that is the same as `of`, one of `crossings`: each is the nearest
/// to the other. Nothing where the other loop no longer reaches 1 there.
template <class Other, class Crossing>
[[nodiscard]] const Other* same_crossing(const std::vector<Other>& others,
                                         const std::vector<Crossing>& crossings, const Crossing& of) {
  const Other* same = nearest_crossing(others, of);
  return same != nullptr && nearest_crossing(crossings, *same) == &of ? same : nullptr;
}

}  // namespace resonid::design
