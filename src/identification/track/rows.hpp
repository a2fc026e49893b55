// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <identification/track/axis_setup.hpp>
#include <identification/track/follower.hpp>
#include <string>
#include <vector>

namespace resonid::identification::detail {

/// Takes the rows: hands every one to the options' sinks, and keeps those that Track holds.
class Rows {
 public:
  Rows(const data::Record& stretch, const TrackOptions& options, const AxisSetup& setup,
       const online::Axis& axis, Track& track);

  void add(const online::Axis& axis, const Place& place);
  /// No row is better than what it was begun from.
  [[nodiscard]] bool trusted(const online::AxisRow& row) const { return row.trusted && !doubtful_; }
  [[nodiscard]] bool doubtful() const { return doubtful_; }
  [[nodiscard]] std::size_t values_per_row() const { return series_.size() + 6; }

 private:
  /// One quantity of the rows: what it is, and where in Track it is kept.
  struct Series {
    std::vector<TrackSeries> Track::*group;
    std::size_t index;
    bool has_std;
    std::function<online::Figure(const online::Axis&)> of;
  };
  using Read = std::function<online::Figure(const online::Axis&)>;

  void add_series(std::vector<TrackSeries> Track::*group, std::string name, std::string unit, bool has_std,
                  Read of);
  void add_lines(const online::Axis& axis);
  void add_chirp();
  void add_parameters(const online::Axis& axis, const AxisSetup& setup);
  void add_figures(const AxisSetup& setup);
  [[nodiscard]] std::vector<std::string> names() const;
  void keep(const Place& place, const online::AxisRow& row);
  void keep_every_second();

  const TrackOptions& options_;
  std::vector<Series> series_;
  std::vector<online::Figure> values_;  // [series] of the newest row
  bool has_position_;
  bool doubtful_;           // the learning stretch has shown an error
  std::size_t stride_ = 1;  // between rows that are kept; doubles when they become too many
  std::vector<double> flat_;
  Track& track_;
};

/// Most values that Track holds when all rows are kept: 160 MB.
inline constexpr std::size_t kMostValues = 20'000'000;

}  // namespace resonid::identification::detail
