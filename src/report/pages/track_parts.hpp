// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/track.hpp>
#include <resonid/report/detail/document.hpp>
#include <string>
#include <vector>

// Parts of the page of a track.
namespace resonid::report {

/// What the charts run over: the position of a machine that moves, else time.
struct TrackAxis {
  std::string label;
  const std::vector<double>& x;
  bool time;
};

/// Stretches of rows that are not trusted, over time.
[[nodiscard]] std::vector<Shape> untrusted(const identification::Track& track);

/// The response at lines over time, in colour and as curves, or along a chirp.
[[nodiscard]] Section track_response_section(const identification::Track& track, const TrackAxis& time);

}  // namespace resonid::report
