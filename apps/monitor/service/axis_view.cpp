// SPDX-License-Identifier: MIT
#include "monitor/service/axis_view.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

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

/// Whether all that is known of the axis was taken in by a former process.
bool is_of_before(const AxisView& v) { return v.intake.arrived_ns() == 0 && v.live.next_sample > 0; }

/// Whether no samples come. While an axis learns, or waits to, the engine does not look, and its source may
/// have to wait; on a busy machine samples may come again before the engine has its turn.
bool is_silent(const AxisView& v) {
  const bool follows = v.live.phase == Phase::following;
  if (follows ? !v.live.stale : v.ring_fills) return false;
  const std::int64_t arrived = v.intake.arrived_ns();
  if (follows && arrived == 0) return true;
  return seconds(v.now_ns - (arrived != 0 ? arrived : v.started_ns)) >= v.stale_s;
}

/// Why an axis of which no samples come is not trusted.
std::string why_no_samples(const AxisView& v) {
  if (v.intake.arrived_ns() != 0) return "no samples come";
  const auto started = fmt::localtime(static_cast<std::time_t>(v.started_ns / 1'000'000'000));
  return fmt::format("no samples have come since the service started at {:%Y-%m-%d %H:%M:%S %z}{}", started,
                     is_of_before(v) ? "; what is known is from before" : "");
}

web::AxisState state_of(const LiveAxis& live, const Intake& intake, bool silent) {
  if (silent) return intake.refusal().empty() ? web::AxisState::stale : web::AxisState::refused;
  if (live.phase == Phase::following) return web::AxisState::following;
  if (!anything_came(live, intake) || live.phase == Phase::resting) return web::AxisState::waiting;
  return web::AxisState::learning;
}

/// Why a row is not trusted, in words.
std::string why(const AxisView& v, bool silent) {
  using V = online::AxisVerdict;
  const auto& live = v.live;
  const auto& intake = v.intake;
  const bool came = anything_came(live, intake);
  if (silent || !came)
    if (const auto refusal = intake.refusal(); !refusal.empty()) return "what comes is refused: " + refusal;
  if (silent) return why_no_samples(v);
  if (live.phase != Phase::following) {
    if (!live.reason.empty()) return live.reason;
    if (!came) return "waits for the first samples";
    return live.waits_to_learn ? "waits for its turn to learn: axes learn one after the other"
                               : "learns what the machine is";
  }
  if (live.stale) return "samples come again, and are still to be taken in";
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

/// UNIX, of the row's newest sample; 0: not known. A row of a former process has the time of the ring: the
/// engine takes what is left there for new where the sender tells no time.
std::int64_t time_of_row(const AxisView& v) {
  if (v.live.row_ns != 0 && !is_of_before(v)) return v.live.row_ns;
  if (v.due.time_ns == 0 || v.live.row.sample == 0) return 0;
  const double since = static_cast<double>(v.due.sample) - static_cast<double>(v.live.row.sample);
  return v.due.time_ns - std::llround(since * 1e9 / v.installed.spec.sample_rate_hz);
}

/// What is known of the machine that is followed now; what is kept of a former one is not shown.
void add_figures(const AxisView& v, web::AxisStatus& s) {
  const auto& live = v.live;
  s.verdict = live.row.verdict;
  s.trusted = live.row.trusted && !live.stale;
  if (const std::int64_t time_ns = time_of_row(v); time_ns != 0) {
    const double lag_s = live.row.lag_samples / v.installed.spec.sample_rate_hz;
    s.time_s = seconds(time_ns) - (std::isfinite(lag_s) ? lag_s : 0.0);
  }
  // A sender's clock may be ahead of ours.
  if (live.newest_ns != 0 && !live.stale && !is_of_before(v))
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

/// UNIX, of the newest sample; 0: none is known.
std::int64_t time_of_newest(const AxisView& v, bool silent) {
  const std::int64_t arrived = v.intake.arrived_ns(), told = v.live.newest_ns;
  // Its sender's clock may have been ahead.
  if (is_of_before(v)) return std::min(v.due.time_ns, v.started_ns);
  // Samples wait while it learns.
  if (v.live.phase != Phase::following || told == 0 || (v.live.stale && !silent)) return arrived;
  return silent ? std::min(told, arrived) : told;  // clocks of senders differ
}

void add_age(const AxisView& v, web::AxisStatus& s, bool silent) {
  const std::int64_t newest = time_of_newest(v, silent);
  if (newest == 0) return;
  s.newest_time_s = seconds(newest);
  s.age_s = std::max(0.0, seconds(v.now_ns - newest));
}

}  // namespace

std::string why_not_trusted(const AxisView& view) { return why(view, is_silent(view)); }

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
  s.why = why(view, silent);
  s.motion = installed.spec.motion;
  s.units = monitoring::figure_units(installed.spec);
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
