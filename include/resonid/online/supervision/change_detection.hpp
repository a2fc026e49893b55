// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <resonid/base/detail/intact.hpp>
#include <resonid/base/expected.hpp>
#include <resonid/online/supervision/detail/change_config.hpp>
#include <resonid/online/supervision/detail/change_statistics.hpp>
#include <resonid/online/supervision/detail/learned_baseline.hpp>

namespace resonid::online {

/// Watches any tracked figure (a resonance, a stiffness, a margin) for a lasting change, with a stated rate
/// of false alarms. What the figure is while nothing changes is learned from itself: level, spread and
/// correlation.
///
/// 1. blocks: values weighted by 1/std^2 are averaged over `block_s`, so that hardly more than the
/// correlation from one
///    block to the next is left;
/// 2. what is new in each block, in standard deviations (LearnedBaseline), is next to standard normal and
/// independent.
///    Learning goes on after `baseline_s`, `window_blocks` behind, so that it does not take in what is to be
///    found;
/// 3. two-sided CUSUM, or the likelihood ratio over a window, with the threshold that makes false alarms
///    `false_alarm_interval_s` apart in the mean (Siegmund's formulas). What the baseline does not know yet
///    about level, spread and correlation is allowed for: a short baseline finds less, it does not cry wolf.
///
/// A value that is not finite counts as missing, and what an estimator merely holds should be given as
/// missing; a block with less than half of its values is passed over. After an alarm the change is measured
/// on, the baseline kept; relearn() starts anew. Limits: changes during the baseline belong to it; what
/// drifts within many times `baseline_s` is learned, not found; tails far heavier than normal ones, or
/// correlation beyond two blocks (`reliable()`), make more false alarms than stated. Source:
/// Basseville and Nikiforov 1993.
template <class Real, std::size_t MaxWindow = 256>
class ChangeDetector {
 public:
  static expected<ChangeDetector, Error> create(const ChangeDetectorConfig& config) noexcept;

  /// One value of the figure. `standard_deviation` as the estimator tells it; only ratios between values
  /// count, 1 when there is none. `doubt`: by how much the block of this value counts as less sure than
  /// others, >= 1, for what is known to disturb the estimator now and then; the baseline learns from it as
  /// from others.
  void step(Real value, Real standard_deviation = Real(1), Real doubt = Real(1)) noexcept;
  void reset() noexcept { *this = ChangeDetector(config_); }
  /// Takes what comes for a new baseline, keeping the time.
  void relearn() noexcept;
  /// The figure is back at its baseline: after an alarm, looks for changes from it again. What came since the
  /// alarm is not learned.
  void resume() noexcept;

  /// Whether the baseline is learned: changes can be found from now on.
  [[nodiscard]] bool ready() const noexcept {
    return static_cast<double>(blocks_) * config_.block_s >= config_.baseline_s;
  }
  [[nodiscard]] bool alarm() const noexcept { return alarm_; }
  [[nodiscard]] Change change() const noexcept;  ///< After an alarm.
  /// After an alarm: the size of the change is that of the newest `blocks` and what follows.
  void measure_from(std::uint64_t blocks) noexcept;
  /// Value of the statistic; an alarm from 1 on.
  [[nodiscard]] double level() const noexcept { return level_; }
  [[nodiscard]] double threshold() const noexcept;  ///< Threshold of the statistic in its own terms.
  [[nodiscard]] double baseline() const noexcept { return alarm_ ? before_mean_ : baseline_.mean(); }
  /// Standard deviation of the baseline, as far as the newest blocks are not of it.
  [[nodiscard]] double baseline_std() const noexcept {
    return alarm_ ? std::sqrt(before_variance_) : baseline_.mean_std(baseline_.total_precision());
  }
  /// Standard deviation of what is new in a block: what the statistic's figures are in.
  [[nodiscard]] double block_std() const noexcept;
  /// Whether blocks are as independent as the stated rate of false alarms needs: the sum of 16 of them
  /// spreads as it should. Otherwise take longer blocks, or an estimator of shorter memory.
  [[nodiscard]] bool reliable() const noexcept {
    return groups_ < 4.0 || group_squares_ / (kGroup * groups_) < 1.2 + 3.0 * std::sqrt(2.0 / groups_);
  }
  [[nodiscard]] std::uint64_t samples() const noexcept { return samples_; }
  [[nodiscard]] std::uint64_t skipped_samples() const noexcept { return skipped_; }

  /// For a state of unknown origin (base/detail/intact.hpp).
  [[nodiscard]] bool intact() const noexcept {
    return resonid::intact(config_.statistic, ChangeStatistic::likelihood_ratio) && !fault_of(config_) &&
           likelihood_ratio_.intact() && resonid::intact(alarm_) && in_group_ >= 0 && in_group_ < kGroup &&
           learned_ <= blocks_ && (alarm_ || blocks_ - learned_ <= MaxWindow);
  }

 private:
  static constexpr int kGroup = 16;
  /// Blocks of the recent past, for the mean since a change and before it.
  struct Block {
    double sum = 0.0;  // precision times mean
    double precision = 0.0;
    std::uint64_t end_sample = 0;
    [[nodiscard]] double mean() const noexcept { return sum / precision; }
  };
  explicit ChangeDetector(const ChangeDetectorConfig& config) noexcept;
  static std::optional<Error> fault_of(const ChangeDetectorConfig& config) noexcept;
  static constexpr std::size_t slot(std::uint64_t block) noexcept {  // in past_
    return static_cast<std::size_t>(block % (MaxWindow + 1));
  }
  [[nodiscard]] double distance_of(const Block& before, const Block& block) const noexcept {  // in blocks
    return static_cast<double>(block.end_sample - before.end_sample) / static_cast<double>(block_samples_);
  }
  void end_block() noexcept;
  void learn() noexcept;
  void gather(double standardised) noexcept;
  void watch(const Block& now, const Block& before, double doubt) noexcept;
  void judge(const ChangeStatisticState& state) noexcept;
  void measure_after(std::uint64_t first) noexcept;

  ChangeDetectorConfig config_{};
  std::size_t block_samples_ = 1;
  Cusum cusum_;
  LikelihoodRatio<MaxWindow> likelihood_ratio_;
  LearnedBaseline baseline_;

  double sum_ = 0.0, precision_ = 0.0, doubt_ = 1.0;  // of the running block
  std::size_t in_block_ = 0, seen_in_block_ = 0;
  std::array<Block, MaxWindow + 1> past_{};  // ring
  std::uint64_t blocks_ = 0, learned_ = 0;
  int in_group_ = 0;
  double group_sum_ = 0.0, group_squares_ = 0.0, groups_ = 0.0;

  double level_ = 0.0;
  bool alarm_ = false;
  std::uint64_t change_sample_ = 0, alarm_sample_ = 0;
  double before_mean_ = 0.0, before_variance_ = 0.0;
  double after_sum_ = 0.0, after_precision_ = 0.0;
  std::uint64_t samples_ = 0, skipped_ = 0;
};

}  // namespace resonid::online

#include <resonid/online/supervision/detail/change_detection_impl.hpp>
