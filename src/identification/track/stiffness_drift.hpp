// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <cmath>
#include <identification/track/plan.hpp>
#include <resonid/base/detail/byte_archive.hpp>
#include <vector>

namespace resonid::identification::detail {

/// Relative change of the stiffness per second to reckon with, from the positions seen so far.
///
/// A belt's stiffness goes with one over its length: at speed v it changes by v/length per second, at most
/// about 1.6 times the speed over the range that the machine goes through, which is not known before it has
/// gone there. Its distance from the position's zero stands for it as long as that is the larger one.
class StiffnessDrift {
 public:
  explicit StiffnessDrift(double sample_rate_hz)
      : rate_hz_(sample_rate_hz),
        past_(std::max<std::size_t>(1, static_cast<std::size_t>(kWindow_s * rate_hz_))) {}

  void step(double position) {
    low_ = std::min(low_, position);
    high_ = std::max(high_, position);
    // Over a window long enough for the excitation's own shaking to average out.
    double& oldest = past_[samples_ % past_.size()];
    if (samples_ >= past_.size())
      fastest_ =
          std::max(fastest_, std::abs(position - oldest) * rate_hz_ / static_cast<double>(past_.size()));
    oldest = position;
    ++samples_;
  }
  [[nodiscard]] double per_s() const {
    const double range = std::max({high_ - low_, std::abs(low_), std::abs(high_)});
    return range > 0.0 && samples_ > 0 ? std::clamp(kUneven * fastest_ / range, kUnknownMachine, kMost)
                                       : kUnknownMachine;
  }

  void save(ByteWriter& to) const {
    to.put(past_);
    to.put(samples_);
    to.put(low_);
    to.put(high_);
    to.put(fastest_);
  }
  void restore(ByteReader& from) {
    from.get(past_);
    from.get(samples_);
    from.get(low_);
    from.get(high_);
    from.get(fastest_);
    if (past_.empty()) past_.resize(1);
  }

  static constexpr double kUnknownMachine = 0.03;

 private:
  static constexpr double kWindow_s = 0.5;
  static constexpr double kUneven = 1.6;
  static constexpr double kMost = 1.0;
  double rate_hz_;
  std::vector<double> past_;  // ring
  std::size_t samples_ = 0;
  double low_ = std::numeric_limits<double>::infinity(), high_ = -low_, fastest_ = 0.0;
};

/// Whether the drift follows the positions: not when it is told, nor in a chirp, since what a sweep says of
/// the stiffness it says once.
[[nodiscard]] inline bool drift_follows_position(const data::Record& stretch, const TrackOptions& options,
                                                 const TrackPlan& plan) {
  return !options.drift_per_s && !plan.measurement.sweep && stretch.position.present();
}
[[nodiscard]] inline double first_drift(const data::Record& stretch, const TrackOptions& options,
                                        const TrackPlan& plan) {
  if (options.drift_per_s) return *options.drift_per_s;
  if (plan.measurement.sweep) return 0.0;
  StiffnessDrift drift(stretch.sample_rate_hz);
  for (const double x : stretch.position.samples) drift.step(x);
  return drift.per_s();
}

}  // namespace resonid::identification::detail
