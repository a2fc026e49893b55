// SPDX-License-Identifier: MIT
#pragma once

#include <fmt/format.h>

#include <cstdint>
#include <resonid/base/enum_names.hpp>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace resonid::monitor {

enum class LogLevel : std::uint8_t { error, warning, info, debug };
inline constexpr EnumName<LogLevel> kLogLevelNames[] = {{LogLevel::error, "error"},
                                                        {LogLevel::warning, "warning"},
                                                        {LogLevel::info, "info"},
                                                        {LogLevel::debug, "debug"}};
[[nodiscard]] constexpr std::span<const EnumName<LogLevel>> enum_names(LogLevel) noexcept {
  return kLogLevelNames;
}

/// Up to which level the process says what it does on standard error; at the start `error`.
void set_log_level(LogLevel level) noexcept;
[[nodiscard]] LogLevel log_level() noexcept;

/// A line as it is written: `2026-11-29T10:02:03.456Z warning TEXT`, or, for the journal of systemd, which
/// has the time itself, `<4>TEXT`. Control characters of foreign bytes are replaced.
[[nodiscard]] std::string log_line(LogLevel level, std::string_view text, std::int64_t time_ns, bool journal);

/// Whether standard error is the stream that the journal of systemd gave to this process
/// (JOURNAL_STREAM=DEVICE:INODE).
[[nodiscard]] bool logs_to_journal();

/// Writes one line, whole, to standard error. For any thread.
void write_log(LogLevel level, std::string_view text) noexcept;

template <class... Values>
void say(LogLevel level, fmt::format_string<Values...> format, Values&&... values) {
  if (level <= log_level()) write_log(level, fmt::format(format, std::forward<Values>(values)...));
}

}  // namespace resonid::monitor
