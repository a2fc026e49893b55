// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <monitor/store/sqlite.hpp>
#include <string>
#include <string_view>

namespace resonid::monitor::detail {

inline constexpr std::int64_t kSchemaVersion = 2;
inline constexpr std::int64_t kFiveMinutesNs = 300'000'000'000;
inline constexpr std::int64_t kHourNs = 12 * kFiveMinutesNs;
inline constexpr std::int64_t kDayNs = 24 * kHourNs;

/// The start of the five minutes, the hour or the day (UTC) that an instant lies in; earlier than 1970 as
/// well.
[[nodiscard]] constexpr std::int64_t start_of(std::int64_t time_ns, std::int64_t length_ns) noexcept {
  const std::int64_t into = time_ns % length_ns;
  return time_ns - (into < 0 ? into + length_ns : into);
}

/// Makes the tables of an empty database, brings those of a former version up to date; throws where the file
/// is another program's or a later version's.
void prepare_schema(Connection& connection, const std::string& path, std::string_view program_version);

/// Throws where damage is found within `limit_s`; small tables are looked at first and the rows last.
void check_quickly(Connection& connection, const std::string& path, double limit_s);

}  // namespace resonid::monitor::detail
