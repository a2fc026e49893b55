// SPDX-License-Identifier: MIT
// What people do, as the live service takes it.
#include <fmt/format.h>

#include <cmath>

#include "monitor/service/alarm_record.hpp"
#include "monitor/service/answers.hpp"
#include "monitor/service/live_backend.hpp"

namespace resonid::monitor {
namespace {

using detail::no;
using detail::seconds;
using monitoring::AlarmId;
using web::Answer;
using web::Problem;

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
    return Problem{Problem::Kind::invalid, "until_time_s", "the end of shelving must lie ahead"};
  if (kind == K::shelve && seconds && *seconds > longest_s)
    return Problem{Problem::Kind::invalid, "until_time_s",
                   fmt::format("the end of shelving lies {:.1f} h ahead; at most {:.1f} h are required "
                               "(longest_shelving_s of the alarm)",
                               *seconds / 3600.0, longest_s / 3600.0)};
  return std::nullopt;
}

double longest_shelving_s(const monitoring::AxisAlarmRules& rules, AlarmId alarm) {
  return static_cast<double>(rules[alarm].longest_shelving) / rules.sample_rate_hz();
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
  if (kind == K::set_baseline)
    if (const auto status = status_of(*index, *live); !status.trusted)
      return no(Problem::Kind::conflict, "axis",
                fmt::format("a baseline is made of trusted estimates, which there are none of now: {}",
                            status.why.empty() ? "the axis does not follow its drive" : status.why));
  // What is asked while the axis learns is done, and known here, once it has.
  if (action.kind == web::ActionKind::end_maintenance && live->phase == monitoring::Phase::following &&
      live->maintenance_until_ns == 0)
    return no(Problem::Kind::conflict, "axis", "the axis is not in maintenance");
  std::optional<double> seconds_from_now;
  if (std::isfinite(action.until_time_s)) seconds_from_now = action.until_time_s - seconds(now_ns());
  if (kind < K::maintenance)
    if (auto refused = refusal_of(kind, live->alarms[alarm.index()], seconds_from_now,
                                  monitor::longest_shelving_s(rules_[*index], alarm))) {
      if (refused->kind == Problem::Kind::invalid && action.in_seconds) refused->field = "seconds";
      return tl::unexpected(std::move(*refused));
    }
  if (const auto done = engine_.act(*index, kind, alarm, seconds_from_now, action.who, action.reason); !done)
    return no(Problem::Kind::unavailable, "axis", done.error().requirement.str());
  return {};
}

}  // namespace resonid::monitor
