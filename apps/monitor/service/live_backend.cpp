// SPDX-License-Identifier: MIT
#include "monitor/service/live_backend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "monitor/service/alarm_record.hpp"
#include "monitor/service/evidence_report.hpp"
#include "monitor/service/raw_csv.hpp"

namespace resonid::monitor {
namespace {

using monitoring::AlarmId;
using monitoring::Phase;
using web::Answer;
using web::kUnknown;
using web::Problem;
using Json = nlohmann::json;

constexpr std::size_t kMostEvents = 1000;
constexpr std::size_t kMostBaselines = 20;
constexpr double kHangs_s = 30.0;
constexpr std::int64_t kGathering_ns = 15'000'000'000;

double seconds(std::int64_t ns) { return static_cast<double>(ns) * 1e-9; }
std::int64_t ns_of(double unix_s) { return static_cast<std::int64_t>(std::llround(unix_s * 1e9)); }

auto no(Problem::Kind kind, std::string field, std::string message) {
  return tl::unexpected(Problem{kind, std::move(field), std::move(message)});
}
auto broken(const StoreError& error) { return no(Problem::Kind::unavailable, "store", error.text); }

bool anything_came(const LiveAxis& live, const Intake& intake) {
  return live.next_sample > 0 || intake.arrived_ns() != 0;
}

/// Whether no samples come. While an axis learns, or waits to, the engine does not look.
bool is_silent(const AxisView& v) {
  if (v.live.phase == Phase::following) return v.live.stale;
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
    return live.phase == Phase::learning ? "learns what the machine is, or waits for its turn to learn"
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

std::string why(const LiveAxis& live, const Intake& intake) { return why(live, intake, live.stale); }

web::AlarmChange change_of(const Json& json) {
  return {json.value("before", kUnknown), json.value("after", kUnknown),    json.value("size", kUnknown),
          json.value("std", kUnknown),    json.value("relative", kUnknown), json.value("sigma", kUnknown)};
}

/// Whether an alarm that is not yet written was open within; its events are not to be had.
bool is_within(const AlarmRecord& record, const TimeSpan& span) {
  return record.raised_ns < span.to_ns &&
         (record.open || std::max(record.raised_ns, record.cleared_ns.value_or(0)) >= span.from_ns);
}

/// As Reader::alarms() chooses them.
bool is_among(const AlarmRecord& record, const web::AlarmQuestion& q) {
  if (!q.axis.empty() && q.axis != record.axis) return false;
  switch (q.state) {
    case web::AlarmFilter::open:
      return record.open;
    case web::AlarmFilter::active:
      return record.open && record.active;
    case web::AlarmFilter::unacknowledged:
      return record.open && !record.acknowledged;
    case web::AlarmFilter::shelved:
      return record.open && record.shelved_until_ns.has_value();
    case web::AlarmFilter::cleared:
      return !record.active;
    case web::AlarmFilter::all:
      break;
  }
  return true;
}

std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return file ? text.str() : std::string();
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

std::optional<Problem> refusal_of(monitoring::ActionKind kind, const monitoring::AlarmState& alarm,
                                  std::optional<double> seconds, double longest_s) {
  using K = monitoring::ActionKind;
  const auto conflict = [](const char* why) { return Problem{Problem::Kind::conflict, "id", why}; };
  if (kind == K::acknowledge && alarm.acknowledged) return conflict("the alarm is acknowledged already");
  if (kind == K::unshelve && alarm.shelving == monitoring::Shelving::none)
    return conflict("the alarm is not shelved");
  if (kind == K::reset && !alarm.latched)
    return conflict("the alarm is not latched: it ends by itself once it has cleared");
  if (kind == K::reset && !alarm.acknowledged) return conflict("the alarm must be acknowledged first");
  if (kind == K::shelve && seconds && *seconds <= 0.0)
    return Problem{Problem::Kind::invalid, "until", "the end of shelving must lie ahead"};
  if (kind == K::shelve && seconds && *seconds > longest_s)
    return Problem{Problem::Kind::invalid, "until",
                   fmt::format("the end of shelving lies {:.1f} h ahead; at most {:.1f} h are required "
                               "(longest_shelving_s of the alarm)",
                               *seconds / 3600.0, longest_s / 3600.0)};
  return std::nullopt;
}

double longest_shelving_s(const monitoring::AxisAlarmRules& rules, AlarmId alarm) {
  return static_cast<double>(rules[alarm].longest_shelving) / rules.sample_rate_hz();
}

monitoring::Detectors detectors_of(const monitoring::AxisSpec& spec, const LiveAxis& live) {
  if (!(live.detector_interval_s > 0.0)) return {};
  const auto& figures = spec.alarms.figures;
  const auto count = std::count_if(figures.begin(), figures.end(),
                                   [](const auto& f) { return f.alarm.enabled && f.changes; });
  return {static_cast<std::size_t>(count), live.detector_interval_s};
}

web::Alarm alarm_of(const AlarmRecord& r) {
  const Json json = Json::parse(r.json, nullptr, false);
  web::Alarm a;
  a.id = std::strtoull(r.id.c_str(), nullptr, 10);
  a.axis = r.axis;
  a.alarm = r.alarm;
  a.severity = static_cast<monitoring::Severity>(std::clamp(r.severity, 0, 2));
  a.active = r.active;
  a.acknowledged = r.acknowledged;
  a.latched = r.latched;
  a.raised_time_s = seconds(r.raised_ns);
  // Soon after the alarm they are still being gathered.
  a.evidence = r.evidence || (!r.axis.empty() && now_ns() - r.raised_ns < kGathering_ns);
  if (r.cleared_ns) a.cleared_time_s = seconds(*r.cleared_ns);
  if (!json.is_object()) return a;
  a.text = json.value("text", "");
  a.cause = json.value("cause", "");
  a.suppressed = json.value("suppressed", "");
  a.since_time_s = seconds(json.value("since_ns", std::int64_t{0}));
  if (r.shelved_until_ns) {
    const Json by = json.value("shelved", Json::object());
    a.shelved =
        web::Alarm::Shelved{seconds(*r.shelved_until_ns), by.value("reason", ""), by.value("who", "")};
  }
  if (json.contains("change")) a.change = change_of(json["change"]);
  return a;
}

web::AlarmEvent event_of(const EventRecord& e) {
  const Json json = Json::parse(e.json, nullptr, false);
  web::AlarmEvent event{seconds(e.time_ns), e.sample, e.transition, "", e.text, "", "", {}};
  if (!json.is_object()) return event;
  event.state = json.value("state", "");
  event.who = json.value("who", "");
  event.reason = json.value("reason", "");
  if (json.contains("change")) event.change = change_of(json["change"]);
  return event;
}

LiveBackend::LiveBackend(const Installation& installation, Engine& engine, const Recorder& recorder,
                         Reader reader, std::vector<Axis> axes, std::vector<RunningSource> sources)
    : installation_(installation),
      engine_(engine),
      recorder_(recorder),
      reader_(std::move(reader)),
      axes_(std::move(axes)),
      coherence_(axes_.size()),
      sources_(std::move(sources)),
      started_ns_(now_ns()) {
  for (const auto& axis : axes_)
    rules_.push_back(monitoring::AxisAlarmRules::create(axis.installed->spec.alarms,
                                                        axis.installed->spec.sample_rate_hz)
                         .value());  // the engine's axis was made with them
}

Answer<std::size_t> LiveBackend::index_of(const std::string& axis) const {
  for (std::size_t i = 0; i < axes_.size(); ++i)
    if (axes_[i].installed->spec.name == axis) return i;
  return no(Problem::Kind::not_found, "axis", fmt::format("there is no axis '{}'", axis));
}

/// The least over its alarms.
double LiveBackend::longest_shelving_s(std::size_t index) const {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < monitoring::kAlarms; ++i)
    if (const auto alarm = AlarmId::of(i); rules_[index][alarm].enabled)
      least = std::min(least, monitor::longest_shelving_s(rules_[index], alarm));
  return least;
}

web::AxisStatus LiveBackend::status_of(std::size_t index, const LiveAxis& live) const {
  const Axis& axis = axes_[index];
  return monitor::status_of({*axis.installed, rules_[index], live, *axis.intake, now_ns(), started_ns_,
                             installation_.engine.stale_s});
}

web::AxisStatus status_of(const AxisView& view) {
  const auto& [installed, rules, live, intake, now, started, stale_s] = view;
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

web::AxisNews LiveBackend::axes(std::uint64_t after) const {
  web::AxisNews news;
  news.revision = engine_.revision();
  for (std::size_t i = 0; i < axes_.size(); ++i)
    if (const auto live = engine_.live(i); live && live->revision > after)
      news.axes.push_back(status_of(i, *live));
  return news;
}

Answer<web::AxisDetail> LiveBackend::axis(const std::string& name) const {
  const auto index = index_of(name);
  if (!index) return tl::unexpected(index.error());
  const auto live = engine_.live(*index);
  const auto& installed = *axes_[*index].installed;
  web::AxisDetail d;
  d.status = status_of(*index, *live);
  d.estimator.method = live->method;
  if (live->memory_s > 0.0) d.estimator.memory_s = live->memory_s;
  if (live->phase == Phase::following) d.estimator.gates = live->row.gates;
  if (live->learned_s > 0.0) d.estimator.learned_s = live->learned_s;
  d.estimator.start = live->start;
  d.longest_shelving_s = longest_shelving_s(*index);
  const auto oldest = oldest_sample(*axes_[*index].ring);
  if (oldest < live->next_sample && live->newest_ns != 0)
    d.raw_from_time_s = seconds(live->newest_ns) -
                        static_cast<double>(live->next_sample - 1 - oldest) / installed.spec.sample_rate_hz;
  d.loop.controller = installed.controller;
  d.loop.delay_s = installed.spec.track.common.delay_s;
  const auto& e = live->estimate;
  d.loop.crossover_hz = e.crossover_hz.value;
  d.loop.gain_margin_db = e.gain_margin_db;
  d.loop.gain_margin_hz = e.gain_margin_hz;
  d.loop.modulus_margin_hz = e.modulus_margin_hz;
  d.loop.worst_phase_margin_deg = e.worst_phase_margin_deg;
  d.configuration_hash = axes_[*index].configuration_hash;
  const std::scoped_lock lock(reader_mutex_);
  if (const auto all = reader_.baselines(name, kMostBaselines))
    for (const auto& b : *all)
      d.baselines.push_back(
          {seconds(b.time_ns), b.sample, b.who, b.reason, d.baselines.empty(), b.figures.figures});
  return d;
}

Answer<web::AxisResponse> LiveBackend::response(const std::string& axis) const {
  const auto index = index_of(axis);
  if (!index) return tl::unexpected(index.error());
  const auto live = engine_.live(*index);
  if (!live->curve || live->curve->frequency_hz.empty())
    return no(Problem::Kind::unavailable, "axis",
              "nothing is known of its response yet: " + why(*live, *axes_[*index].intake));
  const auto& c = *live->curve;
  const auto curve = [](const std::vector<double>& frequency_hz,
                        const std::vector<std::complex<double>>& values, const std::vector<double>& std) {
    web::Curve to;
    to.frequency_hz = frequency_hz;
    for (const auto& v : values) {
      to.real.push_back(v.real());
      to.imag.push_back(v.imag());
    }
    to.std = std;
    return to;
  };
  web::AxisResponse r;
  r.time_s = seconds(live->curve_ns);
  r.plant = curve(c.frequency_hz, c.plant, c.std);
  const auto& a = axes_[*index];
  auto coherence = coherence_[*index].at(*a.ring, a.installed->spec, c.frequency_hz);
  r.plant.coherence = std::move(coherence.value);
  r.plant.coherence_std = std::move(coherence.std);
  if (!c.loop.empty()) r.loop = curve(c.frequency_hz, c.loop, c.loop_std);
  // What a person set came after what was configured.
  if (const auto set = recorder_.baseline_curve(*index)) {
    r.baseline = curve(set->frequency_hz, set->plant, set->std);
  } else if (const auto& configured = axes_[*index].installed->spec.track.baseline) {
    r.baseline = curve(configured->response.frequency_hz, configured->response.value, {});
  }
  return r;
}

Answer<web::History> LiveBackend::history(const std::string& axis, const web::HistoryQuestion& q) const {
  if (const auto index = index_of(axis); !index) return tl::unexpected(index.error());
  const HistoryQuery query{
      axis, q.figures, ns_of(q.from_s), ns_of(q.to_s), std::max<std::uint32_t>(1, q.points), {}};
  const std::scoped_lock lock(reader_mutex_);
  const auto found = reader_.history(query);
  if (!found) return broken(found.error());
  web::History h;
  h.resolution = static_cast<web::Resolution>(found->resolution);
  for (const auto t : found->time_ns) h.time_s.push_back(seconds(t));
  for (std::size_t i = 0; i < q.figures.size(); ++i) {
    web::History::Trend trend;
    trend.figure = q.figures[i];
    for (const auto& f : found->figures[i]) {
      trend.value.push_back(f.mean);
      trend.std.push_back(std::isfinite(f.std) ? f.std : f.own_std);
      trend.min.push_back(f.min);
      trend.max.push_back(f.max);
      trend.trusted.push_back(f.rows > 0 ? static_cast<double>(f.trusted) / f.rows : 0.0);
    }
    h.trends.push_back(std::move(trend));
  }
  return h;
}

Answer<std::string> LiveBackend::raw(const std::string& axis, double from_s, double to_s) const {
  const auto index = index_of(axis);
  if (!index) return tl::unexpected(index.error());
  const auto live = engine_.live(*index);
  const double rate_hz = axes_[*index].installed->spec.sample_rate_hz, newest_s = seconds(live->newest_ns);
  const auto sample_of = [&](double time_s) {
    const double sample = static_cast<double>(live->next_sample) - 1.0 - (newest_s - time_s) * rate_hz;
    return static_cast<std::uint64_t>(std::max(0.0, std::ceil(sample)));
  };
  auto text = raw_csv(*axes_[*index].ring, *axes_[*index].installed, sample_of(from_s), sample_of(to_s));
  if (text.empty())
    return no(
        Problem::Kind::not_found, "from",
        fmt::format("no samples of this time are kept: the newest {:.0f} s are",
                    static_cast<double>(live->next_sample - oldest_sample(*axes_[*index].ring)) / rate_hz));
  return text;
}

Answer<web::Comparison> LiveBackend::compare(const std::string& axis, double a_time_s,
                                             double b_time_s) const {
  if (const auto index = index_of(axis); !index) return tl::unexpected(index.error());
  const std::scoped_lock lock(reader_mutex_);
  const auto found = reader_.compare(axis, ns_of(a_time_s), ns_of(b_time_s));
  if (!found) return broken(found.error());
  web::Comparison c;
  for (const auto& d : *found) {
    if (!d.a || !d.b) continue;
    c.a_time_s = 0.5 * (seconds(d.a->from_ns) + seconds(d.a->to_ns));
    c.b_time_s = 0.5 * (seconds(d.b->from_ns) + seconds(d.b->to_ns));
    c.lines.push_back({d.figure,
                       {d.a->summary.mean, d.a->summary.std},
                       {d.b->summary.mean, d.b->summary.std},
                       d.difference,
                       d.std,
                       d.sigma});
  }
  if (c.lines.empty())
    return no(Problem::Kind::not_found, "a", "no trusted rows within a week of both times");
  return c;
}

std::vector<web::Alarm> LiveBackend::alarms(const web::AlarmQuestion& q) const {
  const AlarmFilter filter = from_name<AlarmFilter>(name_of(q.state)).value_or(AlarmFilter::all);
  const auto axis = q.axis.empty() ? std::nullopt : std::optional(q.axis);
  const std::size_t limit = std::max<std::uint32_t>(1, q.limit);
  const TimeSpan span{ns_of(q.from_s), ns_of(q.to_s)};
  const auto unwritten = recorder_.status().unwritten;
  std::vector<web::Alarm> all;
  for (const auto& record : unwritten)
    if (is_among(record, q) && is_within(record, span)) all.push_back(told(record));
  const std::scoped_lock lock(reader_mutex_);
  if (const auto found = reader_.alarms(filter, axis, limit, span))
    for (const auto& record : *found)
      if (is_among(record, q) && std::none_of(unwritten.begin(), unwritten.end(),
                                              [&](const auto& newer) { return newer.id == record.id; }))
        all.push_back(told(record));
  if (all.size() > limit) all.resize(limit);
  return all;
}

web::Alarm LiveBackend::told(const AlarmRecord& record) const {
  web::Alarm alarm = alarm_of(record);
  const auto index = index_of(record.axis);
  const auto id = monitoring::alarm_from_name(record.alarm);
  if (index && id) alarm.longest_shelving_s = monitor::longest_shelving_s(rules_[*index], *id);
  return alarm;
}

Answer<web::Alarm> LiveBackend::alarm(std::uint64_t alarm) const {
  const auto record = record_of(alarm);
  if (!record) return tl::unexpected(record.error());
  return told(*record);
}

Answer<AlarmRecord> LiveBackend::record_of(std::uint64_t alarm) const {
  const std::string id = std::to_string(alarm);
  for (auto& record : recorder_.status().unwritten)
    if (record.id == id) return std::move(record);
  const std::scoped_lock lock(reader_mutex_);
  auto found = reader_.alarm(id);
  if (!found) return broken(found.error());
  if (!*found) return no(Problem::Kind::not_found, "id", fmt::format("there is no alarm {}", alarm));
  return std::move(**found);
}

Answer<std::vector<web::AlarmEvent>> LiveBackend::events(std::uint64_t alarm) const {
  if (const auto record = record_of(alarm); !record) return tl::unexpected(record.error());
  const std::scoped_lock lock(reader_mutex_);
  const auto found = reader_.events(std::to_string(alarm), kMostEvents);
  if (!found) return broken(found.error());
  std::vector<web::AlarmEvent> all;
  for (const auto& e : *found) all.push_back(event_of(e));
  return all;
}

Answer<std::string> LiveBackend::evidence(std::uint64_t alarm) const {
  std::string file;
  {
    const std::scoped_lock lock(reader_mutex_);
    const auto found = reader_.evidence(std::to_string(alarm));
    if (!found) return broken(found.error());
    if (!found->empty()) file = found->front().file;
  }
  if (file.empty()) {
    if (const auto record = record_of(alarm); !record) return tl::unexpected(record.error());
    return no(Problem::Kind::unavailable, "id",
              "its raw samples are not kept, or not complete yet: they are some seconds after the alarm");
  }
  std::string text = file_text(installation_.data / "evidence" / std::filesystem::path(file).filename());
  if (text.empty()) return no(Problem::Kind::unavailable, "id", "the file of its raw samples cannot be read");
  return text;
}

Answer<std::string> LiveBackend::report(std::uint64_t alarm) const {
  const auto record = record_of(alarm);
  if (!record) return tl::unexpected(record.error());
  if (const auto text = evidence(alarm); !text) return text;
  const auto csv = installation_.data / "evidence" / fmt::format("{}.csv", alarm);
  auto html = csv;
  html.replace_extension(".html");
  if (auto made = file_text(html); !made.empty()) return made;
  const auto index = index_of(record->axis);
  if (!index)
    return no(Problem::Kind::not_found, "axis",
              fmt::format("axis '{}' is no longer configured; evidence.csv has what was kept", record->axis));
  // It takes all of a core for seconds: one at a time, so that the others who answer are free.
  const std::unique_lock one(report_mutex_, std::try_to_lock);
  if (!one.owns_lock())
    return no(Problem::Kind::unavailable, "id", "another report is being made; try again in half a minute");
  auto page = evidence_report(*axes_[*index].installed, csv);
  if (!page) return no(Problem::Kind::unavailable, "id", "its raw samples show no result: " + page.error());
  return std::move(*page);
}

std::vector<web::AuditEntry> LiveBackend::audit(const web::AuditQuestion& q) const {
  std::vector<web::AuditEntry> all;
  const std::scoped_lock lock(reader_mutex_);
  if (const auto found = reader_.audit(std::max<std::uint32_t>(1, q.limit), {ns_of(q.from_s), ns_of(q.to_s)}))
    for (const auto& a : *found) {
      const Json json = Json::parse(a.arguments, nullptr, false);
      std::string text;
      const auto kind = from_name<monitoring::ActionKind>(a.kind);
      if (json.is_object() && kind && *kind < monitoring::ActionKind::maintenance)
        text = monitoring::alarm_name(
            AlarmId::of(std::min<std::size_t>(json.value("alarm", std::size_t{0}), monitoring::kAlarms - 1)));
      const bool ends = json.is_object() && kind == monitoring::ActionKind::maintenance &&
                        json.value("until_sample", std::uint64_t{0}) <= a.sample;
      all.push_back({seconds(a.time_ns), a.axis, ends ? "end-maintenance" : a.kind, a.who, a.reason, text});
    }
  return all;
}

web::ServiceStatus LiveBackend::status() const {
  web::ServiceStatus s;
  s.version = installation_.version;
  s.started_time_s = seconds(started_ns_);
  s.uptime_s = seconds(now_ns() - started_ns_);
  s.axes = axes_.size();
  for (const auto& source : sources_) {
    const auto now = source.source->status();
    s.sources.push_back({source.installed->name,
                         source.installed->kind,
                         std::string(name_of(now.state)),
                         std::string(source.source->promise()),
                         now.messages,
                         now.bytes,
                         now.lost,
                         now.text,
                         {}});
    for (const auto& [kind, name] : kFaultNames)
      if (const auto count = now.faults[static_cast<std::size_t>(kind)]; count > 0)
        s.sources.back().faults.push_back({std::string(name), count, {}});
  }
  const auto store = recorder_.status();
  s.store = {store.bytes,          store.pending,
             store.disk_full,      store.fault.empty() ? store.over_limit : store.fault,
             !store.fault.empty(), !store.over_limit.empty()};
  s.threshold.false_alarm_interval_s = installation_.false_alarm_interval_s;
  if (!axes_.empty()) s.threshold.per_figure_s = axes_.front().installed->spec.false_alarm_interval_s;
  std::vector<monitoring::Detectors> detectors;
  for (std::size_t i = 0; i < axes_.size(); ++i)
    if (const auto live = engine_.live(i)) detectors.push_back(detectors_of(axes_[i].installed->spec, *live));
  if (const double present_s = monitoring::installation_interval_s(detectors); std::isfinite(present_s))
    s.threshold.present_interval_s = present_s;
  for (const auto& d : store.deliveries)
    s.deliveries.push_back({d.name, d.waiting, d.delivered, d.failures, d.given_up, d.fault});
  return s;
}

web::Readiness LiveBackend::readiness() const {
  web::Readiness r;
  const auto store = recorder_.status();
  const double turn_s = engine_.turn_s();
  r.engine = turn_s < kHangs_s;
  r.store = store.fault.empty();
  r.text = store.fault.empty() ? store.over_limit : store.fault;
  if (!r.engine)
    r.text += fmt::format("{}the engine hangs since {:.0f} s", r.text.empty() ? "" : "; ", turn_s);
  r.sources = true;
  for (const auto& source : sources_) {
    const auto now = source.source->status();
    if (now.state == SourceState::running || now.state == SourceState::ended) continue;
    r.sources = false;
    r.text += fmt::format("{}source {} is {}: {}", r.text.empty() ? "" : "; ", source.installed->name,
                          name_of(now.state), now.text);
  }
  return r;
}

Answer<void> LiveBackend::act(const web::Action& action) {
  using K = monitoring::ActionKind;
  std::string axis = action.axis;
  AlarmId alarm{};
  K kind = K::acknowledge;
  switch (action.kind) {
    case web::ActionKind::acknowledge:
      kind = K::acknowledge;
      break;
    case web::ActionKind::shelve:
      kind = std::isfinite(action.until_time_s) ? K::shelve : K::shelve_once;
      break;
    case web::ActionKind::unshelve:
      kind = K::unshelve;
      break;
    case web::ActionKind::reset:
      kind = K::reset;
      break;
    case web::ActionKind::baseline:
      kind = K::set_baseline;
      break;
    case web::ActionKind::relearn:
      kind = K::relearn;
      break;
    case web::ActionKind::maintenance:
    case web::ActionKind::end_maintenance:
      kind = K::maintenance;
      break;
  }
  if (kind < K::maintenance) {
    const auto record = record_of(action.alarm);
    if (!record) return tl::unexpected(record.error());
    if (record->axis.empty())
      return no(Problem::Kind::conflict, "id",
                "it is an alarm of the installation, which goes by itself: when there is room on the disk");
    if (!record->open)
      return no(Problem::Kind::conflict, "id",
                "the alarm is over: cleared, acknowledged and not latched, or raised again");
    axis = record->axis;
    if (const auto known = monitoring::alarm_from_name(record->alarm)) alarm = *known;
  }
  const auto index = index_of(axis);
  if (!index) return tl::unexpected(index.error());
  const auto live = engine_.live(*index);
  if (kind < K::maintenance &&
      action.alarm != alarm_number(axis, alarm, live->alarms[alarm.index()].raised_sample))
    return no(Problem::Kind::conflict, "id",
              "the alarm was raised again since, which is an alarm of its own");
  std::optional<double> seconds_from_now;
  if (std::isfinite(action.until_time_s)) seconds_from_now = action.until_time_s - seconds(now_ns());
  if (kind < K::maintenance)
    if (auto refused = refusal_of(kind, live->alarms[alarm.index()], seconds_from_now,
                                  monitor::longest_shelving_s(rules_[*index], alarm)))
      return tl::unexpected(std::move(*refused));
  if (const auto done = engine_.act(*index, kind, alarm, seconds_from_now, action.who, action.reason); !done)
    return no(Problem::Kind::unavailable, "axis", done.error().requirement.str());
  return {};
}

}  // namespace resonid::monitor
