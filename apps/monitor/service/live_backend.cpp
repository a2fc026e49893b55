// SPDX-License-Identifier: MIT
#include "monitor/service/live_backend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "monitor/service/answers.hpp"
#include "monitor/service/evidence_report.hpp"
#include "monitor/service/raw_csv.hpp"

namespace resonid::monitor {
namespace {

using detail::no;
using detail::ns_of;
using detail::seconds;
using monitoring::AlarmId;
using monitoring::Phase;
using web::Answer;
using web::Problem;
using Json = nlohmann::json;

constexpr std::size_t kMostEvents = 1000;
constexpr std::size_t kMostBaselines = 20;
constexpr double kHangs_s = 30.0;

auto broken(const StoreError& error) { return no(Problem::Kind::unavailable, "store", error.text); }
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

/// UNIX time of the first one: by its sender, else by the axis' rate, from the newest one on.
std::optional<std::int64_t> time_of(const Piece& piece, const LiveAxis& live) {
  if (piece.time_ns || live.newest_ns == 0) return piece.time_ns;
  const double since = static_cast<double>(live.next_sample) - 1.0 - static_cast<double>(piece.first_sample);
  return live.newest_ns - std::llround(since * piece.interval_ns);
}

struct SampleSpan {
  std::uint64_t from = 0, to = 0;  // the latter not included
};
/// All from the first to the last one of that time; of a time that was twice, as a clock was put back, those
/// of the second one.
SampleSpan samples_between(const Ring& ring, const LiveAxis& live, std::int64_t from_ns, std::int64_t to_ns) {
  SampleSpan found;
  std::int64_t newest_ns = 0;  // of the pieces in it
  for (std::uint64_t at = ring.begin(); at < ring.end();) {
    const Piece piece = ring.piece(at);
    if (piece.samples == 0 || piece.position < ring.begin()) {  // overwritten meanwhile, as in Ring::copy()
      at = std::max(at + 1, ring.begin());
      continue;
    }
    at = piece.position + piece.samples;
    const auto begin_ns = time_of(piece, live);
    if (!begin_ns) continue;
    const auto samples_before = [&](std::int64_t time_ns) {
      const double since_ns = static_cast<double>(time_ns) - static_cast<double>(*begin_ns);
      return static_cast<std::uint64_t>(
          std::clamp(std::ceil(since_ns / piece.interval_ns), 0.0, static_cast<double>(piece.samples)));
    };
    const std::uint64_t first = samples_before(from_ns), last = samples_before(to_ns);
    if (first >= last) continue;
    if (found.to == 0 || *begin_ns < newest_ns) found.from = piece.first_sample + first;
    found.to = piece.first_sample + last;
    newest_ns = *begin_ns;
  }
  return found;
}

std::string file_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return file ? text.str() : std::string();
}

}  // namespace

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
  for (const auto& axis : axes_) {
    due_.push_back({axis.ring->next_sample(), axis.ring->next_time_ns().value_or(0)});
    rules_.push_back(monitoring::AxisAlarmRules::create(axis.installed->spec.alarms,
                                                        axis.installed->spec.sample_rate_hz)
                         .value());  // the engine's axis was made with them
  }
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

AxisView LiveBackend::view_of(std::size_t index, const LiveAxis& live) const {
  const Axis& axis = axes_[index];
  const Ring& ring = *axis.ring;
  const bool fills = ring.end() - ring.read() > ring.settings().capacity / 2;
  return {*axis.installed,
          rules_[index],
          live,
          *axis.intake,
          now_ns(),
          started_ns_,
          stale_after_s(installation_.engine, axis.installed->spec.sample_rate_hz),
          fills,
          due_[index]};
}

web::AxisStatus LiveBackend::status_of(std::size_t index, const LiveAxis& live) const {
  return monitor::status_of(view_of(index, live));
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
  const Ring& ring = *axes_[*index].ring;
  if (const auto oldest = ring.piece(ring.begin(), 1); oldest.samples > 0)
    if (const auto time_ns = time_of(oldest, *live)) d.raw_from_time_s = seconds(*time_ns);
  d.loop.controller = installed.controller;
  d.loop.delay_s = installed.spec.track.common.delay_s;
  const auto& e = live->estimate;
  d.loop.crossover_hz = e.crossover_hz.value;
  d.loop.gain_margin_db = e.gain_margin_db;
  d.loop.gain_margin_hz = e.gain_margin_hz;
  d.loop.modulus_margin_hz = e.modulus_margin_hz;
  d.loop.worst_phase_margin_deg = e.worst_phase_margin_deg;
  d.configuration_hash = axes_[*index].configuration_hash;
  const std::int64_t forgotten_ns = recorder_.baselines(*index).forgotten_ns;
  const std::scoped_lock lock(reader_mutex_);
  if (const auto all = reader_.baselines(name, kMostBaselines))
    for (const auto& b : *all)
      d.baselines.push_back({seconds(b.time_ns), b.sample, b.who, b.reason,
                             d.baselines.empty() && b.time_ns > forgotten_ns, b.figures.figures});
  return d;
}

Answer<web::AxisResponse> LiveBackend::response(const std::string& axis) const {
  const auto index = index_of(axis);
  if (!index) return tl::unexpected(index.error());
  const auto live = engine_.live(*index);
  if (!live->curve || live->curve->frequency_hz.empty())
    return no(Problem::Kind::unavailable, "axis",
              "nothing is known of its response yet: " + why_not_trusted(view_of(*index, *live)));
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
  // That of a former process is as old as its row.
  r.time_s = live->curve_ns != 0 ? seconds(live->curve_ns) : status_of(*index, *live).time_s;
  r.plant = curve(c.frequency_hz, c.plant, c.std);
  const auto& a = axes_[*index];
  auto coherence = coherence_[*index].at(*a.ring, a.installed->spec, c.frequency_hz);
  r.plant.coherence = std::move(coherence.value);
  r.plant.coherence_std = std::move(coherence.std);
  if (!c.loop.empty()) r.loop = curve(c.frequency_hz, c.loop, c.loop_std);
  // What a person set came after what was configured.
  if (const auto set = recorder_.baselines(*index).curve) {
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
  const Axis& a = axes_[*index];
  const auto asked = samples_between(*a.ring, *engine_.live(*index), ns_of(from_s), ns_of(to_s));
  auto text = raw_csv(*a.ring, *a.installed, {asked.from, asked.to}, axis + ".csv");
  if (!text.empty()) return text;
  return no(
      Problem::Kind::not_found, "from",
      fmt::format("no samples of this time are kept, or none came then: the newest {:.0f} s of samples "
                  "are kept",
                  static_cast<double>(a.ring->end() - a.ring->begin()) / a.installed->spec.sample_rate_hz));
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
    return no(Problem::Kind::not_found, "a",
              "no trusted rows within a week of both times, or the times are too close");
  return c;
}

Answer<std::vector<web::Alarm>> LiveBackend::alarms(const web::AlarmQuestion& q) const {
  const AlarmFilter filter = from_name<AlarmFilter>(name_of(q.state)).value_or(AlarmFilter::all);
  const auto axis = q.axis.empty() ? std::nullopt : std::optional(q.axis);
  const std::size_t limit = std::max<std::uint32_t>(1, q.limit);
  const TimeSpan span{ns_of(q.from_s), ns_of(q.to_s)};
  const auto unwritten = recorder_.status().unwritten;
  std::vector<web::Alarm> all;
  for (const auto& record : unwritten)
    if (is_among(record, q) && is_within(record, span)) all.push_back(told(record));
  const std::scoped_lock lock(reader_mutex_);
  const auto found = reader_.alarms(filter, axis, limit, span);
  if (!found) return broken(found.error());
  for (const auto& record : *found)
    if (is_among(record, q) && std::none_of(unwritten.begin(), unwritten.end(),
                                            [&](const auto& newer) { return newer.id == record.id; }))
      all.push_back(told(record));
  if (all.empty() && !q.axis.empty())
    if (const auto known = knows(q.axis, unwritten); !known) return tl::unexpected(known.error());
  if (all.size() > limit) all.resize(limit);
  return all;
}

/// Whether it is configured, or was once and had an alarm.
Answer<void> LiveBackend::knows(const std::string& axis, const std::vector<AlarmRecord>& unwritten) const {
  const auto index = index_of(axis);
  if (index || std::any_of(unwritten.begin(), unwritten.end(),
                           [&](const auto& record) { return record.axis == axis; }))
    return {};
  const auto found = reader_.alarms(AlarmFilter::all, axis, 1);
  if (!found) return broken(found.error());
  if (found->empty()) return tl::unexpected(index.error());
  return {};
}

Answer<web::AlarmCounts> LiveBackend::active_alarms() const {
  const auto unwritten = recorder_.status().unwritten;
  const std::scoped_lock lock(reader_mutex_);
  const auto found = reader_.active_alarms(unwritten);
  if (!found) return broken(found.error());
  return counts_of(*found);
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
  auto page = evidence_report(*axes_[*index].installed, csv, installation_.version);
  if (!page)
    return no(page.error().lasts ? Problem::Kind::conflict : Problem::Kind::unavailable, "id",
              "its raw samples show no result: " + page.error().text);
  return std::move(*page);
}

Answer<std::vector<web::AuditEntry>> LiveBackend::audit(const web::AuditQuestion& q) const {
  std::vector<web::AuditEntry> all;
  const std::scoped_lock lock(reader_mutex_);
  const auto found = reader_.audit(std::max<std::uint32_t>(1, q.limit), {ns_of(q.from_s), ns_of(q.to_s)});
  if (!found) return broken(found.error());
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

}  // namespace resonid::monitor
