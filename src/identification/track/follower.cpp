// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/track/findings.hpp>
#include <identification/track/follower.hpp>

namespace resonid::identification::detail {

void Positions::step(double x) {
  if (past_.size() < kKept)
    past_.push_back(x);
  else
    past_[samples_ % kKept] = x;
  ++samples_;
}

double Positions::at(double sample) const {
  if (past_.empty()) return kUnknown;
  const double oldest = static_cast<double>(samples_ - past_.size());
  const double place = std::clamp(sample, oldest, static_cast<double>(samples_ - 1));
  const auto below = static_cast<std::size_t>(place);
  const double x = past_[below % kKept];
  const double part = place - static_cast<double>(below);
  return part > 0.0 ? x + part * (past_[(below + 1) % kKept] - x) : x;
}

Follower::Follower(const data::Record& stretch, const TrackOptions& options, TrackPlan plan,
                   std::unique_ptr<AxisSetup> setup, AxisPointer axis)
    : plan_(std::move(plan)),
      setup_(std::move(setup)),
      axis_(std::move(axis)),
      rate_hz_(stretch.sample_rate_hz),
      start_time_s_(stretch.start_time_s),
      raw_time_(options.raw_time),
      follows_position_(drift_follows_position(stretch, options, plan_)),
      drift_(rate_hz_),
      drift_per_s_(setup_->config.physical.stiffness_drift_per_s) {}

/// The drift to reckon with follows the positions, by steps that make a difference.
void Follower::look_at(double position, bool speaks) {
  positions_.step(position);
  drift_.step(position);
  constexpr double kStep = 1.1;
  const double now = drift_.per_s();
  if (!speaks || !follows_position_ || (now < kStep * drift_per_s_ && drift_per_s_ < kStep * now)) return;
  drift_per_s_ = now;
  axis_->set_stiffness_drift(now);
}

bool Follower::step(const online::AxisSample<double>& sample, double position, bool speaks) {
  if (std::isfinite(position)) look_at(position, speaks);
  const bool due = axis_->step(sample);
  if (!speaks) {
    learned_ = axis_->result().counts;
    return false;
  }
  if (!due) return false;
  const auto& row = axis_->row();
  const double lag = std::max(0.0, row.lag_samples);
  const double described = static_cast<double>(row.sample) - (raw_time_ || !std::isfinite(lag) ? 0.0 : lag);
  // A lag that grows by more than a sample a sample must not turn time back.
  newest_time_s_ = std::max(newest_time_s_, start_time_s_ + described / rate_hz_);
  place_ = {newest_time_s_, lag / rate_hz_, positions_.at(described)};
  return true;
}

}  // namespace resonid::identification::detail
