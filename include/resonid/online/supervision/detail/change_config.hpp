// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>

namespace resonid::online {

enum class ChangeStatistic {
  cusum,             ///< For a change of about the size that `reference` is made for.
  likelihood_ratio,  ///< For a change of any size.
};

struct ChangeDetectorConfig {
  double sample_rate_hz = 0.0;  ///< Rate at which step() is called, > 0.
  /// Values are averaged over so long, > 0: twice the memory of the estimator that gives them, or more.
  double block_s = 0.0;
  double baseline_s = 0.0;  ///< Learning before the first alarm is possible, at least 16 blocks.
  /// Mean time between false alarms, at least 50 blocks.
  double false_alarm_interval_s = 0.0;
  ChangeStatistic statistic = ChangeStatistic::likelihood_ratio;
  /// Reference value of the CUSUM: half the change that is to be found soonest, in standard deviations of a
  /// block, 0.05 ... 3.
  double reference = 0.5;
  std::size_t window_blocks = 64;  ///< Window of the likelihood ratio, 1 ... MaxWindow.
};

/// A change that was found.
struct Change {
  double time_s = 0.0;      ///< When it began, as far as it shows: start of the first block after it.
  double detected_s = 0.0;  ///< When the alarm came; both since reset().
  double size = 0.0;  ///< Mean since then minus the mean before; of a ramp, what it made so far in the mean.
  double size_std = 0.0;
};

}  // namespace resonid::online
