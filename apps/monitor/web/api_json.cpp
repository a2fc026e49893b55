// SPDX-License-Identifier: MIT
#include "monitor/web/api_json.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>

namespace resonid::monitor::web {
namespace {

using Json = nlohmann::ordered_json;
using monitoring::Watched;

constexpr EnumName<Watched> kKeys[] = {{Watched::resonance, "resonance_hz"},
                                       {Watched::antiresonance, "antiresonance_hz"},
                                       {Watched::stiffness, "stiffness"},
                                       {Watched::driven_inertia, "driven_inertia"},
                                       {Watched::load_inertia, "load_inertia"},
                                       {Watched::damping, "damping"},
                                       {Watched::coulomb_friction, "coulomb_friction"},
                                       {Watched::load_torque, "load_torque"},
                                       {Watched::modulus_margin, "modulus_margin"},
                                       {Watched::phase_margin, "phase_margin_deg"},
                                       {Watched::gap, "gap"}};
static_assert(std::size(kKeys) == monitoring::kWatched);

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);  // names and faults are foreign bytes
}

void put(Json& to, const char* key, double value) {
  if (std::isfinite(value)) to[key] = value;
}
void put(Json& to, const char* key, const std::string& text) {
  if (!text.empty()) to[key] = text;
}

Json column(const std::vector<double>& values) {
  Json json = Json::array();
  for (const double x : values) json.push_back(std::isfinite(x) ? Json(x) : Json());
  return json;
}

Json figure(const online::Figure& f) {
  Json json = Json::object();
  put(json, "value", f.value);
  put(json, "std", f.std);
  return json;
}

Json figures(const std::array<online::Figure, monitoring::kWatched>& all) {
  Json json = Json::object();
  for (const auto& [watched, key] : kKeys)
    if (const auto& f = all[static_cast<std::size_t>(watched)]; std::isfinite(f.value)) json[key] = figure(f);
  return json;
}

/// To seven digits, which halve a frame and are more than anybody sees in it.
double rounded(double value) {
  if (!std::isfinite(value) || value == 0.0) return value;
  const double scale = std::pow(10.0, 6.0 - std::floor(std::log10(std::abs(value))));
  return std::isfinite(scale) && scale != 0.0 ? std::round(value * scale) / scale : value;
}

/// What a list and a frame say of an axis; the frame goes out often, and leaves out what hardly changes.
Json status(const AxisStatus& axis, bool full) {
  Json json;
  if (full) json["name"] = axis.name;
  json["state"] = name_of(axis.state);
  json["trusted"] = axis.trusted;
  json["verdict"] = name_of(axis.verdict);
  put(json, "why", axis.why);
  put(json, "time_s", axis.time_s);
  put(json, "age_s", axis.age_s);
  put(json, "latency_s", axis.latency_s);
  json["sample"] = axis.sample;
  put(json, "maintenance_until_time_s", axis.maintenance_until_time_s);
  if (axis.worst_alarm)
    json["worst_alarm"] = {{"severity", name_of(axis.worst_alarm->severity)},
                           {"text", axis.worst_alarm->text}};
  json["alarms"] = axis.alarms;
  json["unacknowledged"] = axis.unacknowledged;
  auto& all = json["figures"] = Json::object();
  for (const auto& [watched, key] : kKeys) {
    const auto& f = axis.figures[static_cast<std::size_t>(watched)];
    if (!std::isfinite(f.now.value) && !(full && std::isfinite(f.baseline))) continue;
    auto& to = all[key] = full ? figure(f.now) : figure({rounded(f.now.value), rounded(f.now.std)});
    if (full) put(to, "baseline", f.baseline);
    put(to, "change", full ? f.change : rounded(f.change));
    put(to, "change_std", full ? f.change_std : rounded(f.change_std));
    if (full) put(to, "low", f.low);
    if (full) put(to, "high", f.high);
  }
  if (!full) return json;
  json["motion"] = name_of(axis.motion);
  const auto& u = axis.units;
  json["units"] = {{"inertia", u.inertia},
                   {"stiffness", u.stiffness},
                   {"damping", u.damping},
                   {"torque", u.torque},
                   {"response", u.response}};
  put(json, "rate_hz", axis.rate_hz);
  const auto& n = axis.samples;
  json["samples"] = {{"received", n.received},
                     {"missing", n.missing},
                     {"late", n.late},
                     {"duplicate", n.duplicate},
                     {"lost", n.lost}};
  auto& faults = json["faults"] = Json::array();
  for (const auto& fault : axis.faults)
    faults.push_back({{"kind", fault.kind}, {"count", fault.count}, {"text", fault.text}});
  put(json, "source", axis.source);
  return json;
}

Json curve(const Curve& c, bool with_frequencies) {
  Json json = Json::object();
  if (with_frequencies) json["frequency_hz"] = column(c.frequency_hz);
  json["real"] = column(c.real);
  json["imag"] = column(c.imag);
  json["std"] = column(c.std);
  if (!c.coherence.empty()) json["coherence"] = column(c.coherence);
  if (!c.coherence_std.empty()) json["coherence_std"] = column(c.coherence_std);
  return json;
}

Json response(const AxisResponse& r) {
  Json json = curve(r.plant, true);
  put(json, "time_s", r.time_s);
  if (r.loop) json["loop"] = curve(*r.loop, false);
  if (r.baseline) json["baseline"] = curve(*r.baseline, true);
  return json;
}

Json change(const AlarmChange& c) {
  Json json = Json::object();
  put(json, "before", c.before);
  put(json, "after", c.after);
  put(json, "size", c.size);
  put(json, "std", c.std);
  put(json, "relative", c.relative);
  put(json, "sigma", c.sigma);
  return json;
}

Json alarm(const Alarm& a) {
  Json json;
  json["id"] = a.id;
  put(json, "axis", a.axis);
  json["alarm"] = a.alarm;
  json["severity"] = name_of(a.severity);
  json["active"] = a.active;
  json["acknowledged"] = a.acknowledged;
  json["latched"] = a.latched;
  if (a.shelved) {
    auto& shelved = json["shelved"] = {{"reason", a.shelved->reason}, {"who", a.shelved->who}};
    put(shelved, "until_time_s", a.shelved->until_time_s);
  }
  put(json, "suppressed", a.suppressed);
  json["text"] = a.text;
  put(json, "cause", a.cause);
  put(json, "since_time_s", a.since_time_s);
  put(json, "raised_time_s", a.raised_time_s);
  put(json, "cleared_time_s", a.cleared_time_s);
  if (a.change) json["change"] = change(*a.change);
  json["evidence"] = a.evidence;
  put(json, "longest_shelving_s", a.longest_shelving_s);
  return json;
}

Json event(const AlarmEvent& e) {
  Json json = {{"sample", e.sample}, {"transition", e.transition}, {"state", e.state}, {"text", e.text}};
  put(json, "time_s", e.time_s);
  put(json, "who", e.who);
  put(json, "reason", e.reason);
  if (e.change) json["change"] = change(*e.change);
  return json;
}

}  // namespace

std::string_view key_of(Watched watched) noexcept {
  for (const auto& known : kKeys)
    if (known.value == watched) return known.name;
  return {};
}

std::optional<Watched> figure_of(std::string_view key) noexcept {
  for (const auto& known : kKeys)
    if (known.name == key) return known.value;
  return std::nullopt;
}

bool worse(const AxisStatus& a, const AxisStatus& b) {
  const auto rank = [](const AxisStatus& x) {
    const int alarm = x.worst_alarm ? -1 - static_cast<int>(x.worst_alarm->severity) : 0;
    const bool ill = x.state == AxisState::stale || x.state == AxisState::refused;
    return std::tuple(alarm, !ill, x.trusted, std::string_view(x.name));
  };
  return rank(a) < rank(b);
}

std::string axes_json(double time_s, const std::vector<AxisStatus>& axes) {
  std::vector<const AxisStatus*> sorted;
  for (const auto& axis : axes) sorted.push_back(&axis);
  std::sort(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) { return worse(*a, *b); });
  Json json;
  json["time_s"] = time_s;
  auto& list = json["axes"] = Json::array();
  for (const auto* axis : sorted) list.push_back(status(*axis, true));
  return text_of(json);
}

std::string axis_json(const AxisDetail& axis) {
  Json json = status(axis.status, true);
  const auto& e = axis.estimator;
  auto& estimator = json["estimator"] = {{"method", e.method}};
  put(estimator, "memory_s", e.memory_s);
  put(estimator, "learned_s", e.learned_s);
  put(estimator, "start", e.start);
  estimator["gates"] = {{"ready", e.gates.ready},         {"excited", e.gates.excited},
                        {"converged", e.gates.converged}, {"physical", e.gates.physical},
                        {"residual", e.gates.residual},   {"complete", e.gates.complete},
                        {"covered", e.gates.covered}};
  auto& loop = json["loop"] = Json::object();
  put(loop, "controller", axis.loop.controller);
  put(loop, "delay_s", axis.loop.delay_s);
  put(loop, "crossover_hz", axis.loop.crossover_hz);
  put(loop, "gain_margin_db", axis.loop.gain_margin_db);
  put(loop, "gain_margin_hz", axis.loop.gain_margin_hz);
  put(loop, "modulus_margin_hz", axis.loop.modulus_margin_hz);
  put(loop, "phase_margin_worst_deg", axis.loop.worst_phase_margin_deg);
  auto& baselines = json["baselines"] = Json::array();
  for (const auto& b : axis.baselines) {
    Json one = {{"sample", b.sample}, {"active", b.active}, {"figures", figures(b.figures)}};
    put(one, "time_s", b.time_s);
    put(one, "who", b.who);
    put(one, "reason", b.reason);
    baselines.push_back(std::move(one));
  }
  put(json, "longest_shelving_s", axis.longest_shelving_s);
  put(json, "raw_from_time_s", axis.raw_from_time_s);
  json["configuration_hash"] = axis.configuration_hash;
  return text_of(json);
}

std::string response_json(const AxisResponse& r) { return text_of(response(r)); }
std::string response_json(std::string_view axis, const AxisResponse& r) {
  Json json = {{"axis", axis}};
  json.update(response(r));
  return text_of(json);
}

std::string history_json(const History& history) {
  Json json;
  json["time_s"] = column(history.time_s);
  auto& all = json["figures"] = Json::object();
  for (const auto& trend : history.trends)
    all[std::string(key_of(trend.figure))] = {{"value", column(trend.value)},
                                              {"std", column(trend.std)},
                                              {"min", column(trend.min)},
                                              {"max", column(trend.max)},
                                              {"trusted", column(trend.trusted)}};
  json["resolution"] = name_of(history.resolution);
  return text_of(json);
}

std::string comparison_json(const Comparison& comparison) {
  Json json = Json::object();
  put(json, "a_time_s", comparison.a_time_s);
  put(json, "b_time_s", comparison.b_time_s);
  auto& all = json["figures"] = Json::object();
  for (const auto& line : comparison.lines) {
    Json one = {{"a", figure(line.a)}, {"b", figure(line.b)}};
    put(one, "difference", line.difference);
    put(one, "std", line.std);
    put(one, "sigma", line.sigma);
    all[std::string(key_of(line.figure))] = std::move(one);
  }
  return text_of(json);
}

std::string alarms_json(const std::vector<Alarm>& alarms) {
  Json list = Json::array();
  for (const auto& a : alarms) list.push_back(alarm(a));
  return text_of({{"alarms", std::move(list)}});
}

std::string events_json(const std::vector<AlarmEvent>& events) {
  Json list = Json::array();
  for (const auto& e : events) list.push_back(event(e));
  return text_of({{"events", std::move(list)}});
}

std::string audit_json(const std::vector<AuditEntry>& entries) {
  Json list = Json::array();
  for (const auto& e : entries) {
    Json one = {{"action", e.action}, {"text", e.text}};
    put(one, "time_s", e.time_s);
    put(one, "axis", e.axis);
    put(one, "who", e.who);
    put(one, "reason", e.reason);
    list.push_back(std::move(one));
  }
  return text_of({{"audit", std::move(list)}});
}

std::string status_json(const ServiceStatus& s) {
  Json json;
  json["version"] = s.version;
  put(json, "started_time_s", s.started_time_s);
  put(json, "uptime_s", s.uptime_s);
  json["axes"] = s.axes;
  auto& sources = json["sources"] = Json::array();
  for (const auto& source : s.sources)
    sources.push_back({{"name", source.name},
                       {"kind", source.kind},
                       {"state", source.state},
                       {"promise", source.promise},
                       {"messages", source.messages},
                       {"bytes", source.bytes},
                       {"lost", source.lost},
                       {"text", source.text}});
  json["store"] = {{"bytes", s.store.bytes},           {"pending", s.store.pending},
                   {"disk_full", s.store.disk_full},   {"failing", s.store.failing},
                   {"over_limit", s.store.over_limit}, {"text", s.store.text}};
  auto& threshold = json["threshold"] = Json::object();
  put(threshold, "false_alarm_interval_s", s.threshold.false_alarm_interval_s);
  put(threshold, "per_figure_s", s.threshold.per_figure_s);
  put(threshold, "present_interval_s", s.threshold.present_interval_s);
  auto& deliveries = json["deliveries"] = Json::array();
  for (const auto& d : s.deliveries)
    deliveries.push_back({{"name", d.name},
                          {"waiting", d.waiting},
                          {"delivered", d.delivered},
                          {"failures", d.failures},
                          {"given_up", d.given_up},
                          {"text", d.text}});
  return text_of(json);
}

std::string readiness_json(const Readiness& r) {
  return text_of({{"ready", r.sources && r.store && r.engine},
                  {"sources", r.sources},
                  {"store", r.store},
                  {"engine", r.engine},
                  {"text", r.text}});
}

std::string error_json(std::string_view field, std::string_view message) {
  return text_of({{"error", {{"field", field}, {"message", message}}}});
}

std::string status_short_json(const AxisStatus& axis) { return text_of(status(axis, false)); }
std::string status_full_json(const AxisStatus& axis) { return text_of(status(axis, true)); }
std::string alarm_json(const Alarm& a) { return text_of(alarm(a)); }
std::string notice_json(const Alarm& a, const AlarmEvent& e) {
  return text_of({{"event", event(e)}, {"alarm", alarm(a)}});
}

}  // namespace resonid::monitor::web
