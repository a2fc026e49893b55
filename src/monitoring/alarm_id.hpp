// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <monitoring/row.hpp>
#include <optional>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>

namespace resonid::monitoring {

/// What an alarm of an axis is about.
enum class AlarmKind : std::uint8_t {
  change,      ///< A figure differs from its baseline.
  limit,       ///< A figure is outside of its absolute limits.
  data,        ///< Samples are missing, faulty, or contradict what was told.
  stale,       ///< No samples come.
  estimate,    ///< Nothing is trusted for too long although the drive is excited.
  controller,  ///< Another controller runs than the one that was given.
};
inline constexpr std::size_t kConditions = 4;  ///< Kinds without a figure: `data` and those after it.
inline constexpr EnumName<AlarmKind> kAlarmKindNames[] = {
    {AlarmKind::change, "change"}, {AlarmKind::limit, "limit"},       {AlarmKind::data, "data"},
    {AlarmKind::stale, "stale"},   {AlarmKind::estimate, "estimate"}, {AlarmKind::controller, "controller"}};
[[nodiscard]] constexpr std::span<const EnumName<AlarmKind>> enum_names(AlarmKind) noexcept {
  return kAlarmKindNames;
}

inline constexpr std::size_t kAlarms = 2 * kWatched + kConditions;  ///< Alarms of an axis.

/// One alarm of an axis.
struct AlarmId {
  AlarmKind kind = AlarmKind::change;
  Watched figure{};  ///< Where the kind has one, else the first.

  [[nodiscard]] constexpr bool has_figure() const noexcept { return kind <= AlarmKind::limit; }
  /// Position among those of an axis, 0 ... kAlarms - 1: changes, limits, conditions.
  [[nodiscard]] constexpr std::size_t index() const noexcept {
    const auto place = static_cast<std::size_t>(kind);
    return has_figure() ? place * kWatched + static_cast<std::size_t>(figure) : 2 * kWatched + place - 2;
  }
  [[nodiscard]] static constexpr AlarmId of(std::size_t index) noexcept {
    if (index < 2 * kWatched)
      return {static_cast<AlarmKind>(index / kWatched), static_cast<Watched>(index % kWatched)};
    return {static_cast<AlarmKind>(index - 2 * kWatched + 2), Watched{}};
  }
  bool operator==(const AlarmId&) const = default;
};

/// "stiffness", "stiffness-limit", "data": stable, for keys and addresses.
[[nodiscard]] inline std::string alarm_name(AlarmId id) {
  if (!id.has_figure()) return std::string(name_of(id.kind));
  return std::string(name_of(id.figure)) + (id.kind == AlarmKind::limit ? "-limit" : "");
}
[[nodiscard]] inline std::optional<AlarmId> alarm_from_name(std::string_view name) {
  for (std::size_t i = 0; i < kAlarms; ++i)
    if (alarm_name(AlarmId::of(i)) == name) return AlarmId::of(i);
  return std::nullopt;
}

}  // namespace resonid::monitoring
