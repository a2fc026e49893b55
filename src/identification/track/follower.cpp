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

void Positions::save(ByteWriter& to) const {
  to.put(past_);
  to.put(samples_);
}

void Positions::restore(ByteReader& from) {
  from.get(past_);
  from.get(samples_);
}

Follower::Follower(std::unique_ptr<AxisSetup> setup, AxisPointer axis)
    : setup_(std::move(setup)),
      axis_(std::move(axis)),
      rate_hz_(setup_->config.sample_rate_hz),
      start_time_s_(0.0),
      raw_time_(false),
      follows_position_(false),
      drift_(rate_hz_),
      drift_per_s_(0.0) {}

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

void Follower::save(ByteWriter& to) const {
  to.put(static_cast<std::uint64_t>(sizeof(online::Axis)));
  setup_->save(to);
  to.put_sparse({reinterpret_cast<const std::byte*>(axis_.get()), sizeof(online::Axis)});
  to.put(plan_.method);
  to.put(plan_.approach);
  to.put(plan_.reason);
  to.put(plan_.delay_s);
  to.put(static_cast<std::uint64_t>(plan_.learned_samples));
  to.put(plan_.start ? plan_.start->source : std::string());
  to.put(learned_);
  to.put(start_time_s_);
  to.put(raw_time_);
  to.put(follows_position_);
  positions_.save(to);
  drift_.save(to);
  to.put(drift_per_s_);
  to.put(newest_time_s_);
  to.put(place_);
}

std::unique_ptr<Follower> Follower::restored(ByteReader& from) {
  std::uint64_t size = 0, learned_samples = 0;
  from.get(size);
  auto setup = AxisSetup::restored(from);
  if (!setup || size != sizeof(online::Axis)) return nullptr;
  auto axis = axis_memory();
  from.get_sparse({reinterpret_cast<std::byte*>(axis.get()), sizeof(online::Axis)});
  if (!from.ok() || !axis->intact()) return nullptr;
  std::unique_ptr<Follower> f(new Follower(std::move(setup), std::move(axis)));
  std::string start;
  from.get(f->plan_.method);
  from.get(f->plan_.approach);
  from.get(f->plan_.reason);
  from.get(f->plan_.delay_s);
  from.get(learned_samples);
  from.get(start);
  f->plan_.learned_samples = static_cast<std::size_t>(learned_samples);
  if (!start.empty()) f->plan_.start = StartModel{{}, std::move(start)};
  from.get(f->learned_);
  from.get(f->start_time_s_);
  from.get(f->raw_time_);
  from.get(f->follows_position_);
  f->positions_.restore(from);
  f->drift_.restore(from);
  from.get(f->drift_per_s_);
  from.get(f->newest_time_s_);
  from.get(f->place_);
  return from.ok() ? std::move(f) : nullptr;
}

expected<std::unique_ptr<Follower>, Error> learn(const data::Record& stretch, const TrackOptions& options,
                                                 bool final) {
  auto plan = make_track_plan(stretch, options, final);
  if (!plan) return tl::unexpected(std::move(plan.error()));
  if (!*plan) return nullptr;
  auto setup = axis_setup(stretch, options, **plan);
  if (!setup) return tl::unexpected(std::move(setup.error()));
  auto axis = make_axis(**setup, **plan);
  if (!axis) return tl::unexpected(std::move(axis.error()));
  return std::make_unique<Follower>(stretch, options, std::move(**plan), std::move(*setup), std::move(*axis));
}

}  // namespace resonid::identification::detail
