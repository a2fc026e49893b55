// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <monitoring/alarm_id.hpp>
#include <resonid/base/enum_names.hpp>
#include <span>

namespace resonid::monitoring {

/// What people, or the service for them, do to an axis or to one of its alarms.
enum class ActionKind : std::uint8_t {
  acknowledge,   ///< An alarm: seen.
  shelve,        ///< An alarm, until a sample: not now.
  shelve_once,   ///< An alarm, until it has cleared.
  unshelve,      ///< An alarm.
  reset,         ///< A latched alarm that has cleared: dealt with.
  suppress,      ///< An alarm, until it is no longer suppressed.
  unsuppress,    ///< An alarm.
  maintenance,   ///< The axis, until a sample; one that has passed ends it.
  set_baseline,  ///< The axis: what is now is how it should be.
  relearn,       ///< The axis: everything anew.
  stop,          ///< The axis: its samples no longer come. By the service.
  resume,        ///< The axis: they come again. By the service.
  remind,        ///< An alarm that is active and that nobody has acknowledged: told again. By the service.
  gather,  ///< The axis: it has waited to learn for so long that newer samples are gathered. By the service.
};
inline constexpr EnumName<ActionKind> kActionKindNames[] = {{ActionKind::acknowledge, "acknowledge"},
                                                            {ActionKind::shelve, "shelve"},
                                                            {ActionKind::shelve_once, "shelve-once"},
                                                            {ActionKind::unshelve, "unshelve"},
                                                            {ActionKind::reset, "reset"},
                                                            {ActionKind::suppress, "suppress"},
                                                            {ActionKind::unsuppress, "unsuppress"},
                                                            {ActionKind::maintenance, "maintenance"},
                                                            {ActionKind::set_baseline, "baseline"},
                                                            {ActionKind::relearn, "relearn"},
                                                            {ActionKind::stop, "stop"},
                                                            {ActionKind::resume, "resume"},
                                                            {ActionKind::remind, "remind"},
                                                            {ActionKind::gather, "gather"}};
[[nodiscard]] constexpr std::span<const EnumName<ActionKind>> enum_names(ActionKind) noexcept {
  return kActionKindNames;
}

/// An action as an input: at which sample it counts. Who did it and why stands in the audit trail.
struct Action {
  std::uint64_t sample = 0;
  ActionKind kind = ActionKind::acknowledge;
  AlarmId alarm{};                 ///< Where it is about one.
  std::uint64_t until_sample = 0;  ///< shelve, maintenance.
  std::uint64_t id = 0;            ///< Counts the actions of an axis, from 1 on; each counts once.
  /// The same as UNIX time, ns; 0: none. It is kept, for whoever ends it then where samples do not come.
  std::int64_t until_ns = 0;
};

}  // namespace resonid::monitoring
