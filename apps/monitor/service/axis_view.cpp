// SPDX-License-Identifier: MIT
#include "monitor/service/axis_view.hpp"

#include <algorithm>
#include <cmath>

#include "monitor/service/answers.hpp"

namespace resonid::monitor {
namespace {

using detail::seconds;
using monitoring::AlarmId;
using monitoring::Phase;

bool anything_came(const LiveAxis& live, const Intake& intake) {
  return live.next_sample > 0 || intake.arrived_ns() != 0;
}

/// Whether no samples come. While an axis learns, or waits to, the engine does not look, and its source may
/// have to wait.
bool is_silent(const AxisView& v) {
  if (v.live.phase == Phase::following) return v.live.stale;
  if (v.ring_fills) return false;
  const std::int64_t arrived = v.intake.arrived_ns();
  return seconds(v.now_ns - (arrived != 0 ? arrived : v.started_ns)) >= v.stale_s;
}

web::AxisState state_of(const LiveAxis& live, const Intake& intake, bool silent) {
  if (silent) return intake.refusal().empty() ? web::AxisState::stale : web::AxisState::refused;
  if (live.phase == Phase::following) return web::AxisState::following;
  if (!anything_came(live, intake) || live.phase == Phase::resting) return web::AxisState::waiting;
  return web::AxisState::learning;
}

/// Why a row is not trusted, in words.
std::string why(const LiveAxis& live, const Intake& intake, bool silent) {
  using V = online::AxisVerdict;
  const bool came = anything_came(live, intake);
  if (silent || !came)
    if (const auto refusal = intake.refusal(); !refusal.empty()) return "what comes is refused: " + refusal;
  if (silent) return "no samples come";
  if (live.phase != Phase::following) {
    if (!live.reason.empty()) return live.reason;
    if (!came) return "waits for the first samples";
    return live.waits_to_learn ? "waits for its turn to learn: axes learn one after the other"
                               : "learns what the machine is";
  }
  if (!live.row.trusted && !live.reason.empty()) return live.reason;
  switch (live.row.verdict) {
    case V::trusted:
      return "";
    case V::not_measured:
      return "no row yet";
    case V::not_ready:
      return "the estimate still depends on where it began";
    case V::stopped:
      return "the excitation was stopped by a limit";
    case V::samples_missing:
      return "too many samples are missing";
    case V::not_excited:
      return "the machine is not excited";
    case V::unphysical:
      return "the estimate is no possible machine";
    case V::outside_lines:
      return "the resonance lies outside of the lines";
    case V::not_converged:
      return "the resonance has not come to rest";
    case V::residual_grown:
      return "the model explains less than it did";
  }
  return "";
}

/// What is known of the machine that is followed now; what is kept of a former one is not shown.
void add_figures(const AxisView& v, web::AxisStatus& s) {
  const auto& live = v.live;
  s.verdict = live.row.verdict;
  s.trusted = live.row.trusted && !live.stale;
  if (live.row_ns != 0) {
    const double lag_s = live.row.lag_samples / v.installed.spec.sample_rate_hz;
    s.time_s = seconds(live.row_ns) - (std::isfinite(lag_s) ? lag_s : 0.0);
  }
  // A sender's clock may be ahead of ours.
  if (live.newest_ns != 0 && !live.stale)
    s.latency_s = std::max(0.0, seconds(live.processed_ns - live.newest_ns));
  for (std::size_t i = 0; i < monitoring::kWatched; ++i) {
    auto& f = s.figures[i];
    f.now = live.row.figures[i];
    const auto figure = static_cast<monitoring::Watched>(i);
    if (v.rules[{monitoring::AlarmKind::limit, figure}].enabled) {
      f.low = v.rules.low(figure);
      f.high = v.rules.high(figure);
    }
    if (!live.watches[i]) continue;
    const auto& c = live.changes[i];
    f.baseline = c.before;
    f.change = f.now.value - c.before;
    f.change_std = std::hypot(f.now.std, c.before_std);
  }
}

void add_age(const AxisView& v, web::AxisStatus& s, bool silent) {
  const std::int64_t arrived = v.intake.arrived_ns(), told = v.live.newest_ns;
  std::int64_t newest = told;
  if (arrived != 0 && (v.live.phase != Phase::following || silent))
    // Samples wait while it learns, and clocks of senders differ.
    newest = v.live.phase != Phase::following ? arrived : std::min(told, arrived);
  if (newest == 0) return;
  s.newest_time_s = seconds(newest);
  s.age_s = std::max(0.0, seconds(v.now_ns - newest));
}

}  // namespace

std::string why_not_trusted(const LiveAxis& live, const Intake& intake) {
  return why(live, intake, live.stale);
}

monitoring::Detectors detectors_of(const monitoring::AxisSpec& spec, const LiveAxis& live) {
  if (!(live.detector_interval_s > 0.0)) return {};
  const auto& figures = spec.alarms.figures;
  const auto count = std::count_if(figures.begin(), figures.end(),
                                   [](const auto& f) { return f.alarm.enabled && f.changes; });
  return {static_cast<std::size_t>(count), live.detector_interval_s};
}

web::AxisStatus status_of(const AxisView& view) {
  const auto& installed = view.installed;
  const auto& rules = view.rules;
  const auto& live = view.live;
  const auto& intake = view.intake;
  const bool silent = is_silent(view);
  web::AxisStatus s;
  s.name = installed.spec.name;
  s.state = state_of(live, intake, silent);
  s.why = why(live, intake, silent);
  s.motion = installed.spec.motion;
  if (live.phase == Phase::following) add_figures(view, s);
  add_age(view, s, silent);
  s.rate_hz = installed.spec.sample_rate_hz;
  s.sample = live.row.sample;
  if (live.maintenance_until_ns != 0) s.maintenance_until_time_s = seconds(live.maintenance_until_ns);
  s.source = installed.source;
  for (std::size_t i = 0; i < monitoring::kAlarms; ++i) {
    const auto& a = live.alarms[i];
    if (!a.annunciated()) continue;
    ++s.alarms;
    if (!a.acknowledged) ++s.unacknowledged;
    const auto severity = rules.severity(AlarmId::of(i));
    if (!s.worst_alarm || severity > s.worst_alarm->severity)
      s.worst_alarm = web::AxisStatus::Worst{severity, monitoring::alarm_name(AlarmId::of(i))};
  }
  const auto& counts = intake.counters();
  s.samples = {counts.samples.load(), counts.missing.load(), counts.late.load(), counts.duplicate.load(),
               counts.lost.load()};
  for (const auto& fault : kFaultNames)
    if (const auto count = intake.faults().count(fault.value); count > 0)
      s.faults.push_back({std::string(fault.name), count, intake.faults().example(fault.value)});
  return s;
}

}  // namespace resonid::monitor
