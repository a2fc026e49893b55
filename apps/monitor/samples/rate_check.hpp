// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

namespace resonid::monitor {

/// Whether samples come at the rate that was told, by times that are told with them or by when they come. A
/// message may wait on its way: of every five seconds the least delayed one counts. Says so of a rate that is
/// 0.5 % off or more for a minute, in which the samples and the clock run apart steadily; a clock that jumps,
/// a sender that catches up and one that pauses are none.
class RateCheck {
 public:
  explicit RateCheck(double sample_rate_hz) noexcept : rate_hz_(sample_rate_hz) {}

  /// The sample with this index had come, or was taken, at that time (s, of any origin). The rate that was
  /// found where it is another one; at most once in a minute.
  [[nodiscard]] std::optional<double> step(std::uint64_t sample, double time_s);
  void reset() noexcept { points_.clear(); }

 private:
  struct Point {
    double time_s = 0.0;
    double lead_s = 0.0;  ///< By how much the samples are ahead of the clock.
  };
  [[nodiscard]] std::optional<double> steady_rate() const noexcept;

  double rate_hz_;
  std::uint64_t first_sample_ = 0, newest_sample_ = 0;
  double first_s_ = 0.0, newest_s_ = 0.0;
  std::vector<Point> points_;  ///< The one with the most lead of each slot.
};

}  // namespace resonid::monitor
