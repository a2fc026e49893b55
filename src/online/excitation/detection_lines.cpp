// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/online/excitation/detail/detection_lines.hpp>
#include <resonid/online/excitation/multisine.hpp>

namespace resonid::online {

expected<void, Error> mark_kept_lines(const DetectionLinesConfig& c, std::span<bool> kept) noexcept {
  std::fill(kept.begin(), kept.end(), true);
  if (c.detection_lines == DetectionLines::nothing) return {};
  if (c.group < 2) return refuse("group", "must be >= 2", static_cast<double>(c.group));
  const std::size_t period = common_period_samples(c.frequency_hz, c.sample_rate_hz);
  if (period == 0) return refuse("leave_out", "must be nothing: these lines have no common period");
  const double base_hz = c.sample_rate_hz / static_cast<double>(period);
  for (std::size_t i = 0; i < c.frequency_hz.size(); ++i)
    kept[i] = std::llround(c.frequency_hz[i] / base_hz) % 2 != 0;
  const auto odd = static_cast<std::size_t>(std::count(kept.begin(), kept.end(), true));
  if (odd == 0)
    return refuse("leave_out", "must be nothing: all lines are even multiples of this base frequency",
                  base_hz);
  if (c.detection_lines == DetectionLines::even || c.group > odd) return {};
  SplitMix64 random(~c.seed);
  const auto group = static_cast<std::size_t>(c.group);
  std::size_t place = 0;
  std::size_t left_out = 0;
  std::size_t seen = 0;
  for (bool& line : kept) {
    if (!line) continue;
    if (place == 0) {
      if (odd - seen < group) break;
      left_out = static_cast<std::size_t>(random.next() % c.group);
    }
    line = place != left_out;
    place = (place + 1) % group;
    ++seen;
  }
  return {};
}

}  // namespace resonid::online
