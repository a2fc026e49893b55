// SPDX-License-Identifier: MIT
#include "monitor/web/questions.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <utility>

#include "monitor/web/api_json.hpp"

namespace resonid::monitor::web {
namespace {

constexpr double kYear = 366.0 * 86400.0;  // s
constexpr std::size_t kLongestWho = 200;   // characters

unexpected<Problem> invalid(std::string_view field, std::string message) {
  return unexpected<Problem>(Problem{Problem::Kind::invalid, std::string(field), std::move(message)});
}

/// The start of foreign bytes, for a message.
std::string shown(std::string_view text) { return std::string(text.substr(0, 80)); }

/// A parameter that may be there once.
Answer<const std::string*> parameter(const Query& query, const char* key) {
  const auto [first, last] = query.equal_range(key);
  if (first == last) return nullptr;
  if (std::next(first) != last) return invalid(key, "is there more than once, once is required");
  return &first->second;
}

Answer<void> only(const Query& query, std::initializer_list<std::string_view> known) {
  for (const auto& [key, value] : query)
    if (std::find(known.begin(), known.end(), key) == known.end())
      return invalid(shown(key), "is not a parameter of this request");
  return {};
}

Answer<double> number(const std::string& text, const char* key, double least, double most) {
  double value = kUnknown;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc{} || end != text.data() + text.size() || !(value >= least && value <= most))
    return invalid(key,
                   fmt::format("found '{}', a number from {} to {} is required", shown(text), least, most));
  return value;
}

Answer<double> time(const Query& query, const char* key, double otherwise) {
  const auto text = parameter(query, key);
  if (!text) return unexpected<Problem>(text.error());
  if (*text) return number(**text, key, 0.0, kLastTime_s);
  if (std::isnan(otherwise)) return invalid(key, "is missing, a time in UNIX seconds is required");
  return otherwise;
}

Answer<std::uint32_t> count(const Query& query, const char* key, std::uint32_t otherwise,
                            std::uint32_t most) {
  const auto text = parameter(query, key);
  if (!text) return unexpected<Problem>(text.error());
  if (!*text) return otherwise;
  std::uint32_t value = 0;
  const auto* const last = (*text)->data() + (*text)->size();
  const auto [end, code] = std::from_chars((*text)->data(), last, value);
  if (code != std::errc{} || end != last || value == 0 || value > most)
    return invalid(key, fmt::format("found '{}', 1 ... {} is required", shown(**text), most));
  return value;
}

Answer<Interval> interval(const Query& query, const char* from, const char* to, Interval otherwise) {
  const auto a = time(query, from, otherwise.from_s);
  if (!a) return unexpected<Problem>(a.error());
  const auto b = time(query, to, otherwise.to_s);
  if (!b) return unexpected<Problem>(b.error());
  return Interval{*a, *b};
}

Answer<std::uint32_t> limit_of(const Query& query) { return count(query, "limit", 100, kMostAlarms); }

/// Without either, all of time.
Answer<Interval> stretch(const Query& query) {
  const auto found = interval(query, "from", "to", {0.0, kLastTime_s});
  if (found && !(found->from_s < found->to_s))
    return invalid("from",
                   fmt::format("found {}, less than to = {} is required", found->from_s, found->to_s));
  return found;
}

/// A text of a body; control characters would forge lines of a log.
Answer<std::string> body_text(const nlohmann::json& body, const char* key, bool required) {
  const auto found = body.find(key);
  if (found == body.end()) return required ? Answer<std::string>(invalid(key, "is missing")) : std::string();
  if (!found->is_string()) return invalid(key, "a text is required");
  auto text = found->get<std::string>();
  // The parser took nothing but UTF-8, whose characters have one byte each that is not of the form 10xxxxxx.
  const auto length = static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
  if (length > kLongestWho || (required && text.find_first_not_of(' ') == std::string::npos))
    return invalid(key, fmt::format("has {} characters, 1 ... {} are required", length, kLongestWho));
  if (std::any_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 0x20; }))
    return invalid(key, "has a control character");
  return text;
}

}  // namespace

bool is_axis_name(std::string_view name) noexcept {
  constexpr std::string_view kAllowed = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-";
  return !name.empty() && name.size() <= 64 && name != "." && name != ".." &&
         name.find_first_not_of(kAllowed) == std::string_view::npos;
}

Answer<std::uint64_t> alarm_id(std::string_view text) {
  std::uint64_t id = 0;
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), id);
  if (code != std::errc{} || end != text.data() + text.size())
    return invalid("id", fmt::format("found '{}', the number of an alarm is required", shown(text)));
  return id;
}

Answer<HistoryQuestion> history_question(const Query& query, double now_s) {
  if (const auto known = only(query, {"figure", "from", "to", "points"}); !known)
    return unexpected<Problem>(known.error());
  HistoryQuestion question;
  const auto names = parameter(query, "figure");
  if (!names) return unexpected<Problem>(names.error());
  std::string_view rest = *names ? std::string_view(**names) : std::string_view();
  while (*names) {
    const auto name = rest.substr(0, rest.find(','));
    const auto figure = figure_of(name);
    if (!figure) return invalid("figure", fmt::format("found '{}', which is no figure", shown(name)));
    if (std::find(question.figures.begin(), question.figures.end(), *figure) == question.figures.end())
      question.figures.push_back(*figure);
    if (name.size() == rest.size()) break;
    rest.remove_prefix(name.size() + 1);
  }
  if (!*names)
    for (const auto& known : monitoring::kWatchedNames) question.figures.push_back(known.value);
  const auto to = time(query, "to", now_s);
  if (!to) return unexpected<Problem>(to.error());
  const auto from = time(query, "from", std::max(0.0, *to - 3600.0));
  if (!from) return unexpected<Problem>(from.error());
  if (!(*from < *to))
    return invalid("from", fmt::format("found {}, less than to = {} is required", *from, *to));
  const auto points = count(query, "points", 1000, kMostPoints);
  if (!points) return unexpected<Problem>(points.error());
  question.from_s = *from;
  question.to_s = *to;
  question.points = *points;
  return question;
}

Answer<Interval> raw_interval(const Query& query) {
  if (const auto known = only(query, {"from", "to", "token"}); !known)
    return unexpected<Problem>(known.error());
  auto found = interval(query, "from", "to", {kUnknown, kUnknown});
  if (!found) return found;
  if (!(found->from_s < found->to_s && found->to_s - found->from_s <= kLongestRaw))
    return invalid("to", fmt::format("found {} ... {}, at most {} s of samples are handed out at once",
                                     found->from_s, found->to_s, kLongestRaw));
  return found;
}

Answer<Interval> compared_times(const Query& query) {
  if (const auto known = only(query, {"a", "b"}); !known) return unexpected<Problem>(known.error());
  return interval(query, "a", "b", {kUnknown, kUnknown});
}

Answer<AlarmQuestion> alarm_question(const Query& query) {
  if (const auto known = only(query, {"state", "axis", "limit", "from", "to"}); !known)
    return unexpected<Problem>(known.error());
  AlarmQuestion question;
  const auto state = parameter(query, "state");
  if (!state) return unexpected<Problem>(state.error());
  if (*state) {
    const auto filter = from_name<AlarmFilter>(**state);
    if (!filter)
      return invalid(
          "state",
          fmt::format("found '{}', all, open, active, unacknowledged, shelved or cleared is required",
                      shown(**state)));
    question.state = *filter;
  }
  const auto axis = parameter(query, "axis");
  if (!axis) return unexpected<Problem>(axis.error());
  if (*axis) {
    if (!is_axis_name(**axis))
      return invalid("axis", fmt::format("found '{}', which is no name", shown(**axis)));
    question.axis = **axis;
  }
  const auto limit = limit_of(query);
  if (!limit) return unexpected<Problem>(limit.error());
  const auto within = stretch(query);
  if (!within) return unexpected<Problem>(within.error());
  question.limit = *limit;
  question.from_s = within->from_s;
  question.to_s = within->to_s;
  return question;
}

Answer<AuditQuestion> audit_question(const Query& query) {
  if (const auto known = only(query, {"limit", "from", "to"}); !known)
    return unexpected<Problem>(known.error());
  const auto limit = limit_of(query);
  if (!limit) return unexpected<Problem>(limit.error());
  const auto within = stretch(query);
  if (!within) return unexpected<Problem>(within.error());
  return AuditQuestion{*limit, within->from_s, within->to_s};
}

Answer<Action> action_of(ActionKind kind, std::string_view body, double now_s) {
  const auto json = nlohmann::json::parse(body, nullptr, false);
  if (!json.is_object()) return invalid("body", "a JSON object is required");
  const bool timed = kind == ActionKind::shelve || kind == ActionKind::maintenance;
  for (const auto& [key, value] : json.items())
    if (key != "who" && key != "reason" && !(timed && (key == "seconds" || key == "until_time_s")))
      return invalid(shown(key), "is not a part of this action");
  Action action;
  action.kind = kind;
  auto who = body_text(json, "who", true);
  if (!who) return unexpected<Problem>(who.error());
  auto reason = body_text(json, "reason", timed);
  if (!reason) return unexpected<Problem>(reason.error());
  action.who = std::move(*who);
  action.reason = std::move(*reason);
  if (!timed) return action;
  const auto seconds = json.find("seconds"), until = json.find("until_time_s");
  if ((seconds == json.end()) == (until == json.end()))
    return invalid("until_time_s", "one of seconds and until_time_s is required");
  const auto& given = seconds != json.end() ? *seconds : *until;
  const double ahead = !given.is_number()      ? kUnknown
                       : seconds != json.end() ? given.get<double>()
                                               : given.get<double>() - now_s;
  if (!(ahead > 0.0 && ahead <= kYear))
    return invalid(seconds != json.end() ? "seconds" : "until_time_s",
                   "an end that lies at most a year ahead is required");
  action.until_time_s = now_s + ahead;
  action.in_seconds = seconds != json.end();
  return action;
}

}  // namespace resonid::monitor::web
