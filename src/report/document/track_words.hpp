// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/identification/track.hpp>

namespace resonid::report {

/// What a series comes to over the rows that are trusted (over all rows, when none is).
struct SeriesSummary {
  double first = 0.0, last = 0.0, least = 0.0, greatest = 0.0, mean = 0.0;
  std::optional<double> last_deviation;
};
[[nodiscard]] std::optional<SeriesSummary> summary_of(const identification::Track& track,
                                                      const identification::TrackSeries& series);

/// Rows that a file holds at most.
inline constexpr std::size_t kTrackRows = 2000;

/// The findings' plain statement of what was tracked, most important first.
[[nodiscard]] std::vector<std::string> track_sentences(const identification::Track& track);

}  // namespace resonid::report
