// SPDX-License-Identifier: MIT
#include "monitor/samples/rate_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace resonid::monitor {
namespace {

constexpr double kSlot_s = 5.0, kSpan_s = 60.0, kPause_s = 30.0;
constexpr std::size_t kFewestPoints = 6;
constexpr double kOff = 0.005;
constexpr double kWavers_s = 0.05, kWavers = 0.1;  // what a steady difference may leave: of itself, at least
constexpr double kSlowest = 0.4, kFastest = 2.5;   // beyond: a recording that is sent as fast as it goes

}  // namespace

std::optional<double> RateCheck::step(std::uint64_t sample, double time_s) {
  if (!points_.empty() && (sample < newest_sample_ || time_s < newest_s_ || time_s - newest_s_ > kPause_s))
    points_.clear();
  if (points_.empty()) {
    first_sample_ = sample;
    first_s_ = time_s;
  }
  newest_sample_ = sample;
  newest_s_ = time_s;
  const Point now{time_s - first_s_,
                  static_cast<double>(sample - first_sample_) / rate_hz_ - (time_s - first_s_)};
  const auto slot = [](const Point& p) { return std::floor(p.time_s / kSlot_s); };
  if (!points_.empty() && slot(points_.back()) == slot(now)) {
    if (now.lead_s > points_.back().lead_s) points_.back() = now;
    return std::nullopt;
  }
  // The last slot is complete.
  std::optional<double> found;
  if (points_.size() >= kFewestPoints && points_.back().time_s - points_.front().time_s >= kSpan_s) {
    found = steady_rate();
    points_.clear();
    first_sample_ = sample;
    first_s_ = time_s;
    points_.push_back({});
    return found;
  }
  points_.push_back(now);
  return found;
}

std::optional<double> RateCheck::steady_rate() const noexcept {
  const auto n = static_cast<double>(points_.size());
  double t = 0.0, lead = 0.0, tt = 0.0, tl = 0.0;
  for (const Point& p : points_) {
    t += p.time_s / n;
    lead += p.lead_s / n;
  }
  for (const Point& p : points_) {
    tt += (p.time_s - t) * (p.time_s - t);
    tl += (p.time_s - t) * (p.lead_s - lead);
  }
  const double off = tl / tt;  // relative
  if (!(std::abs(off) >= kOff) || 1.0 + off < kSlowest || 1.0 + off > kFastest) return std::nullopt;
  const double allowed = std::max(kWavers_s, kWavers * std::abs(off) * kSpan_s);
  const bool steady = std::all_of(points_.begin(), points_.end(), [&](const Point& p) {
    return std::abs(p.lead_s - lead - off * (p.time_s - t)) <= allowed;
  });
  return steady ? std::optional(rate_hz_ * (1.0 + off)) : std::nullopt;
}

}  // namespace resonid::monitor
