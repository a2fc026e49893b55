// SPDX-License-Identifier: MIT
#pragma once

#include <identification/online_tracker.hpp>
#include <identification/track_loop.hpp>

namespace resonid::identification::detail {

/// One row as it is written.
struct Row {
  double time_s = kUnknown;
  double lag_s = 0.0;
  double position_m = kUnknown;
  double residual = kUnknown;
  std::vector<OnlineValue> reported;  ///< [column of the tracker]
  OnlineValue resonance, antiresonance;
  bool trusted = false;
};

/// Takes the rows: hands every one to the options' sinks, and keeps those that Track holds.
class Rows {
 public:
  Rows(const data::Record& record, const TrackOptions& options, std::vector<OnlineColumn> columns,
       const LoopFigures& loop, std::size_t expected_rows, Track& track);

  void add(const Row& row, const LoopFigures& loop);

 private:
  [[nodiscard]] std::vector<std::string> names() const;
  void keep(const Row& row, const LoopFigures& loop);
  void hand_out(const Row& row, const LoopFigures& loop);
  [[nodiscard]] std::array<double, 3> margins(const LoopFigures& loop) const;

  const TrackOptions& options_;
  std::vector<OnlineColumn> columns_;
  bool has_loop_, has_gap_, has_position_;
  std::size_t stride_ = 1;
  std::vector<double> flat_;
  Track& track_;
};

/// Most values that Track holds when all rows are kept: 160 MB.
inline constexpr std::size_t kMostValues = 20'000'000;

}  // namespace resonid::identification::detail
