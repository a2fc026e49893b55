// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstdint>
#include <monitoring/alarm_settings.hpp>
#include <monitoring/axis_alarms.hpp>
#include <monitoring/row.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/supervision/change_detection.hpp>

namespace resonid::monitoring {

/// Changes of all figures of one axis against what is usual, row by row. Its bytes are its snapshot.
///
/// A change ends when the figure is back: when its mean over the newest 16 blocks differs from the baseline
/// by less than a third of the change, and has grown when that is more than twice of what was told. One that
/// is smaller than it must be to be told is none, and looked for on. Times go on over gaps.
///
/// A load torque that jumps is taken for other parameters for a moment, by more than their standard
/// deviations say: the rows of a block's time after it are doubted (ChangeDetector::step).
class FigureWatch {
 public:
  /// `row_s` from row to row; the others as in online::ChangeDetectorConfig.
  static expected<FigureWatch, Error> create(double row_s, double block_s, double baseline_s,
                                             double false_alarm_interval_s);

  /// Before changes can be told: `baseline_s`, but 16 blocks at least.
  [[nodiscard]] static double learning_s(double block_s, double baseline_s) noexcept;

  void step(const Row& row, const AxisAlarmSettings& settings) noexcept;
  /// So many rows were not made.
  void miss(std::uint64_t rows) noexcept;
  /// What grew with the newest row is told.
  void growth_is_told() noexcept {
    for (auto& w : figures_) w.grown = false;
  }
  /// What the detectors say; times in seconds since sample 0. `first_s`: the time of the first row's sample
  /// less `row_s`.
  [[nodiscard]] std::array<FigureChange, kWatched> changes(double first_s) const noexcept;
  /// Of each detector, as it was made with.
  [[nodiscard]] double false_alarm_interval_s() const noexcept { return false_alarm_interval_s_; }
  /// Rows so far, missed ones too.
  [[nodiscard]] std::uint64_t rows() const noexcept { return figures_[0].detector.samples(); }
  /// Whether changes of the figure can be told yet.
  [[nodiscard]] bool ready(Watched w) const noexcept {
    return figures_[static_cast<std::size_t>(w)].detector.ready();
  }
  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept;

 private:
  using Detector = online::ChangeDetector<double>;
  struct Watching {
    Detector detector;
    double recent = 0.0;       // fading mean since the alarm
    double told = 0.0;         // size of the change
    bool grown = false;        // with the newest row
    std::uint64_t values = 0;  // in it
  };
  FigureWatch(const Detector& detector, double values_back, double false_alarm_interval_s) noexcept;
  void look_back(Watching& w, double value) const noexcept;
  void look_for_load_jump(const Row& row) noexcept;

  std::array<Watching, kWatched> figures_;
  double values_back_;             // 16 blocks of rows
  double load_torque_ = 0.0;       // of the newest trusted row
  std::uint64_t unsure_rows_ = 0;  // still to come, after a jump of the load's torque
  double false_alarm_interval_s_;
};

}  // namespace resonid::monitoring
