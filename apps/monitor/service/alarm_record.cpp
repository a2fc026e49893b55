// SPDX-License-Identifier: MIT
#include "monitor/service/alarm_record.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "monitoring/alarm_text.hpp"

namespace resonid::monitor {
namespace {

using monitoring::AlarmKind;
using monitoring::Transition;
using Json = nlohmann::json;

void put(Json& json, const char* name, double value) {
  if (std::isfinite(value)) json[name] = value;
}

/// What the transition says of the machine.
Json words_of(const Results::TimedEvent& timed) {
  const auto& e = timed.event;
  Json json{{"text", timed.text}, {"since_ns", timed.since_ns}};
  const std::string cause = monitoring::cause_text(e.cause);
  if (!cause.empty()) json["cause"] = cause;
  if (e.alarm.kind != AlarmKind::change) return json;
  Json change = Json::object();
  put(change, "before", e.change.before);
  put(change, "after", e.change.before + e.change.change.size);
  put(change, "size", e.change.change.size);
  put(change, "std", e.change.change.size_std);
  put(change, "relative", e.change.change.size / e.change.before);
  put(change, "sigma", std::abs(e.change.change.size) / e.change.change.size_std);
  json["change"] = std::move(change);
  return json;
}

std::string suppressed_words(std::uint8_t bits) {
  std::string words;
  for (const auto& one : monitoring::kSuppressionNames)
    if ((bits & static_cast<std::uint8_t>(one.value)) != 0)
      words += (words.empty() ? "" : ", ") + std::string(one.name);
  return words;
}

}  // namespace

std::uint64_t alarm_number(const std::string& axis, monitoring::AlarmId alarm, std::uint64_t raised_sample) {
  std::uint64_t hash = 0xcbf29ce484222325U;  // FNV-1a
  const auto mix = [&hash](unsigned char byte) { hash = (hash ^ byte) * 0x100000001b3U; };
  for (const char c : axis) mix(static_cast<unsigned char>(c));
  mix(0);
  mix(static_cast<unsigned char>(alarm.index()));
  for (int i = 0; i < 8; ++i)
    mix(static_cast<unsigned char>(raised_sample >> (8U * static_cast<unsigned>(i))));
  return (hash ^ (hash >> 53U)) & ((std::uint64_t{1} << 53U) - 1);
}

void AlarmRecords::know(const AlarmRecord& record) {
  words_[record.id] = record.json;
  const Json json = Json::parse(record.json, nullptr, false);
  if (json.is_object() && json.contains("shelved"))
    shelvings_[{record.axis, record.alarm}] = json["shelved"].dump();
}

bool AlarmRecords::add(const std::string& axis, double sample_rate_hz, const Results::TimedEvent& timed,
                       Batch& batch) {
  const auto& e = timed.event;
  const auto& state = e.state;
  const std::string alarm = monitoring::alarm_name(e.alarm);
  const std::string transition(name_of(e.transition));
  if (replayed_.erase({axis, e.sample, alarm, transition, timed.action}) > 0) return false;
  const std::string id = std::to_string(alarm_number(axis, e.alarm, state.raised_sample));
  const bool tells = e.transition == Transition::raised || e.transition == Transition::realarmed;
  const auto known = words_.find(id);
  Json before = known != words_.end() ? Json::parse(known->second, nullptr, false) : Json::object();
  if (!before.is_object()) before = Json::object();  // damaged in the store
  Json json = before.empty() || tells ? words_of(timed) : before;
  const auto time_of = [&](std::uint64_t sample) {
    const double since = static_cast<double>(sample) - static_cast<double>(e.sample);
    return timed.time_ns + static_cast<std::int64_t>(std::llround(since / sample_rate_hz * 1e9));
  };
  const bool shelved = state.shelving != monitoring::Shelving::none;
  // Who shelved it and why goes on to the next raising.
  std::string& shelving = shelvings_[{axis, alarm}];
  if (e.transition == Transition::shelved)
    shelving = Json{{"who", timed.who}, {"reason", timed.reason}}.dump();
  if (!shelved && e.transition != Transition::superseded) shelving.clear();
  json.erase("shelved");
  if (shelved && !shelving.empty()) json["shelved"] = Json::parse(shelving);
  // Over a silence samples do not tell how long ago that was.
  if (before.contains("raised_ns")) json["raised_ns"] = before["raised_ns"];
  if (e.transition == Transition::raised) json["raised_ns"] = timed.time_ns;
  if (e.transition == Transition::cleared) json["cleared_ns"] = timed.time_ns;
  json["suppressed"] = suppressed_words(state.suppressed);

  AlarmRecord record;
  record.id = id;
  record.axis = axis;
  record.alarm = alarm;
  record.sample = e.sample;
  record.severity = static_cast<int>(e.severity);
  record.active = state.active;
  record.acknowledged = state.acknowledged;
  record.latched = state.latched;
  record.suppressed = state.suppressed != 0;
  record.open = state.of_interest();
  if (shelved)
    record.shelved_until_ns =
        state.shelved_until_ns != 0 ? state.shelved_until_ns : time_of(state.shelved_until);
  record.raised_ns = json.value("raised_ns", time_of(state.raised_sample));
  if (!state.active) record.cleared_ns = json.value("cleared_ns", time_of(state.cleared_sample));
  record.json = json.dump();
  if (record.open)
    words_[id] = record.json;
  else
    words_.erase(id);
  batch.alarms.push_back(std::move(record));

  Json told = words_of(timed);
  if (!timed.who.empty()) told["who"] = timed.who;
  if (!timed.reason.empty()) told["reason"] = timed.reason;
  if (e.transition == Transition::superseded)
    told["state"] = "over";
  else
    told["state"] = std::string(state.active ? "active" : "cleared") +
                    (state.acknowledged ? ", acknowledged" : ", not acknowledged") +
                    (state.latched ? ", latched" : "") + (shelved ? ", shelved" : "") +
                    (state.suppressed != 0 ? ", suppressed" : "");
  batch.events.push_back(
      {axis, e.sample, alarm, transition, id, timed.time_ns, timed.text, told.dump(), timed.action});
  return true;
}

void AlarmRecords::close(AlarmRecord record, const std::string& reason, std::int64_t time_ns, Batch& batch) {
  words_.erase(record.id);
  const std::string text = fmt::format("{}: over, as {}", record.alarm, reason);
  batch.events.push_back({record.axis, record.sample, record.alarm, std::string(name_of(Transition::reset)),
                          record.id, time_ns, text, Json{{"text", text}, {"state", "over"}}.dump()});
  record.acknowledged = true;
  record.latched = record.suppressed = record.open = false;
  record.shelved_until_ns.reset();
  if (record.active) record.cleared_ns = time_ns;
  record.active = false;
  record.begins_anew = true;
  batch.alarms.push_back(std::move(record));
}

}  // namespace resonid::monitor
