// SPDX-License-Identifier: MIT
#pragma once

#include <CLI/App.hpp>
#include <cstddef>
#include <exception>
#include <identification/track/rows.hpp>
#include <monitoring/axis_monitor.hpp>
#include <optional>
#include <string>
#include <vector>

#include "follow_options.hpp"
#include "monitor/service/configuration.hpp"
#include "monitor/service/replay.hpp"
#include "monitor/web/backend.hpp"
#include "row_writer.hpp"

namespace resonid::cli {

/// What is told of a recording that `monitor --replay` reads; its path is that of `follow.record`.
struct ReplayOptions {
  FollowOptions follow;
  std::string axis, rows;
};
/// --replay, --axis, --rows, and all that `track` has of columns, loop and estimator.
void add_replay_options(CLI::App& verb, ReplayOptions& o);

/// Refuses what has no effect: options of the recording without --replay, or beside a configuration that
/// tells the same.
void refuse_without_effect(const CLI::App& verb, const ReplayOptions& o, bool configured);

/// Reads the recording: as an axis of the configuration, or as the options say.
[[nodiscard]] monitor::Replay read_replay(CLI::App& verb, ReplayOptions& o,
                                          const monitor::Configuration* configuration);

/// The rows of a replay, as `track --out` writes those of a recording.
class ReplayRows {
 public:
  ReplayRows(const std::string& path, const monitor::Replay& replay);
  /// The newest row. For the thread that follows the axis; what fails is told by finish().
  void add(const monitoring::AxisMonitor& axis) noexcept;
  /// Once nobody adds any more.
  void finish();
  [[nodiscard]] std::size_t rows() const noexcept { return track_.rows; }
  /// From when on changes could be told, as a sentence without a full stop.
  [[nodiscard]] std::string told_from() const;

 private:
  void begin(const monitoring::AxisMonitor& axis);
  void note_watch(const monitoring::AxisMonitor& axis, double time_s);

  RowWriter writer_;
  double start_time_s_, end_time_s_;
  std::optional<double> first_row_s_, watched_from_s_;  // of the recording
  double baseline_s_ = 0.0;
  data::Record head_;  // no samples but of the channels that there are
  identification::TrackOptions options_;
  identification::Track track_;
  std::optional<identification::detail::Rows> format_;
  std::vector<std::string> columns_;
  std::uint64_t learned_from_ = 0;
  std::exception_ptr fault_;
};

/// What a replay came to, as text: rows, alarms in their order, how many, and since when changes are told.
[[nodiscard]] std::string replay_text(const monitor::web::Backend& backend, const std::string& rows_path,
                                      const ReplayRows& rows);

}  // namespace resonid::cli
