// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/plant/detail/motion.hpp>

namespace resonid::plant {
namespace {

bool is_positive(double x) { return x > 0.0 && std::isfinite(x); }
bool is_not_negative(double x) { return x >= 0.0 && std::isfinite(x); }

expected<void, Error> check_shaper(const MotionConfig& c) noexcept {
  if (c.shaper_times_s.size() != c.shaper_amplitudes.size())
    return refuse("shaper_times_s", "must hold as many times as shaper_amplitudes holds impulses");
  constexpr double kRounding = 1e-6;
  double sum = 0.0;
  for (const double amplitude : c.shaper_amplitudes) {
    if (!is_positive(amplitude)) return refuse("shaper_amplitudes", "must be > 0", amplitude);
    sum += amplitude;
  }
  if (!c.shaper_amplitudes.empty() && !(std::abs(sum - 1.0) <= kRounding))
    return refuse("shaper_amplitudes", "must be 1 together", sum);
  for (const double time : c.shaper_times_s)
    if (!is_not_negative(time)) return refuse("shaper_times_s", "must be >= 0", time);
  return {};
}

}  // namespace

expected<void, Error> check(const MotionConfig& c) noexcept {
  if (!std::isfinite(c.from)) return refuse("from", "must be finite", c.from);
  if (c.kind == MotionKind::standstill) return {};
  if (c.kind == MotionKind::constant) {
    if (!std::isfinite(c.velocity)) return refuse("velocity", "must be finite", c.velocity);
    return {};
  }
  if (!is_positive(c.velocity)) return refuse("velocity", "must be > 0", c.velocity);
  if (!is_positive(c.acceleration)) return refuse("acceleration", "must be > 0", c.acceleration);
  if (c.kind == MotionKind::s_curve && !is_positive(c.jerk)) return refuse("jerk", "must be > 0", c.jerk);
  if (!std::isfinite(c.to)) return refuse("to", "must be finite", c.to);
  if (c.to == c.from) return refuse("to", "must not be `from`", c.to);
  if (!is_not_negative(c.wait_s)) return refuse("wait_s", "must be >= 0", c.wait_s);
  if (!is_not_negative(c.dwell_s)) return refuse("dwell_s", "must be >= 0", c.dwell_s);
  return check_shaper(c);
}

expected<MotionProfile, Error> MotionProfile::create(const MotionConfig& config) {
  if (const auto ok = check(config); !ok) return unexpected(ok.error());
  MotionProfile profile(config);
  if (profile.moves()) profile.plan();
  return profile;
}

bool MotionProfile::moves() const noexcept {
  return config_.kind == MotionKind::trapezoidal || config_.kind == MotionKind::s_curve;
}

void MotionProfile::plan() noexcept {
  const double a = config_.acceleration;
  const double distance = distance_ = std::abs(config_.to - config_.from);
  if (config_.kind == MotionKind::trapezoidal) {
    peak_velocity_ = std::min(config_.velocity, std::sqrt(distance * a));
    peak_acceleration_ = a;
    smoothing_s_ = 0.0;
  } else {
    const double j = config_.jerk;
    const double rise = a / j;
    const double turning = distance >= 2.0 * a * rise * rise  // the velocity reached without a cruise
                               ? 0.5 * a * (std::sqrt(rise * rise + 4.0 * distance / a) - rise)
                               : std::cbrt(0.25 * distance * distance * j);
    peak_velocity_ = std::min(config_.velocity, turning);
    peak_acceleration_ = std::min(a, std::sqrt(peak_velocity_ * j));
    smoothing_s_ = peak_acceleration_ / j;
  }
  ramp_s_ = peak_velocity_ / peak_acceleration_ + smoothing_s_;
  duration_s_ = ramp_s_ + std::max(distance / peak_velocity_, ramp_s_);
}

/// First half of a move, from rest at 0. The trapezoid's v(t) = a t, p(t) = a t²/2 averaged over the past
/// `smoothing_s_`; the ramp's end mirrors its beginning in the straight line of the cruise.
Setpoint MotionProfile::from_rest(double t) const noexcept {
  const double w = smoothing_s_;
  const double a = peak_acceleration_;
  const double left = ramp_s_ - t;
  if (t < w) {
    const double now = a * t / w;
    return {now * t * t / 6.0, 0.5 * now * t, now};
  }
  if (left > w) {
    const double mid = t - 0.5 * w;
    return {0.5 * a * (mid * mid + w * w / 12.0), a * mid, a};
  }
  const double cruise = peak_velocity_ * (t - 0.5 * ramp_s_);
  if (left <= 0.0) return {cruise, peak_velocity_, 0.0};
  const double now = a * left / w;
  return {cruise + now * left * left / 6.0, peak_velocity_ - 0.5 * now * left, now};
}

/// A whole move over distance_: its second half is the first one turned round.
Setpoint MotionProfile::move(double t) const noexcept {
  if (t < 0.5 * duration_s_) return from_rest(t);
  const Setpoint back = from_rest(std::max(duration_s_ - t, 0.0));
  const bool over = t >= duration_s_;
  return {distance_ - back.position, back.velocity, over ? 0.0 : -back.acceleration};
}

/// Seen from the nearer end, so that both are met exactly.
Setpoint MotionProfile::between(double start, double end, const Setpoint& way) noexcept {
  const double sign = end > start ? 1.0 : -1.0;
  const double distance = std::abs(end - start);
  const double position =
      way.position < 0.5 * distance ? start + sign * way.position : end - sign * (distance - way.position);
  return {position, sign * way.velocity, sign * way.acceleration};
}

Setpoint MotionProfile::at(double time_s) const noexcept {
  if (!moves() || config_.shaper_times_s.empty()) return unshaped(time_s);
  Setpoint sum{config_.from, 0.0, 0.0};
  for (std::size_t i = 0; i < config_.shaper_times_s.size(); ++i) {
    const Setpoint one = unshaped(time_s - config_.shaper_times_s[i]);
    const double part = config_.shaper_amplitudes[i];
    sum.position += part * (one.position - config_.from);
    sum.velocity += part * one.velocity;
    sum.acceleration += part * one.acceleration;
  }
  return sum;
}

Setpoint MotionProfile::unshaped(double time_s) const noexcept {
  if (config_.kind == MotionKind::constant)
    return {config_.from + config_.velocity * time_s, config_.velocity, 0.0};
  if (!moves() || time_s < 0.0) return {config_.from, 0.0, 0.0};
  const double there = config_.wait_s + duration_s_;
  const double back = there + config_.dwell_s;
  const double t = config_.returns ? std::fmod(time_s, back + duration_s_) : time_s;
  if (t < config_.wait_s) return {config_.from, 0.0, 0.0};
  if (t < there) return between(config_.from, config_.to, move(t - config_.wait_s));
  if (t < back || !config_.returns) return {config_.to, 0.0, 0.0};
  return between(config_.to, config_.from, move(t - back));
}

MotionProfile::Range MotionProfile::reached(double duration_s) const noexcept {
  const double last = moves() ? std::min(duration_s, config_.wait_s + duration_s_) : duration_s;
  const double position = unshaped(std::max(last, 0.0)).position;  // a shaped one goes no further
  return {std::min(config_.from, position), std::max(config_.from, position)};
}

}  // namespace resonid::plant
