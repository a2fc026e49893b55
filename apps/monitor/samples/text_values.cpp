// SPDX-License-Identifier: MIT
#include "monitor/samples/text_values.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <system_error>

#include "io/csv_cell.hpp"

namespace resonid::monitor {
namespace {

/// Unit of a UNIX time by its size: each is that of 1973 ... 5138.
struct TimeUnit {
  double least, nanoseconds;
};
constexpr std::array<TimeUnit, 4> kTimeUnits = {{{1e17, 1.0}, {1e14, 1e3}, {1e11, 1e6}, {1e8, 1e9}}};
constexpr double kMostTime = 4e18;  // 2096

/// The digits at the beginning as a number; removes them.
std::optional<int> digits(std::string_view& text, std::size_t count) {
  int value = 0;
  if (text.size() < count) return std::nullopt;
  const auto [end, code] = std::from_chars(text.data(), text.data() + count, value);
  if (code != std::errc() || end != text.data() + count || value < 0) return std::nullopt;
  text.remove_prefix(count);
  return value;
}

bool skip_one_of(std::string_view& text, std::string_view marks) {
  if (text.empty() || marks.find(text.front()) == std::string_view::npos) return false;
  text.remove_prefix(1);
  return true;
}

/// `2026-11-27T14:03:59.125Z`, `2026-11-27 14:03:59+01:00`.
std::optional<std::int64_t> iso_time(std::string_view text) {
  const auto year = digits(text, 4);
  if (!year || !skip_one_of(text, "-")) return std::nullopt;
  const auto month = digits(text, 2);
  if (!month || !skip_one_of(text, "-")) return std::nullopt;
  const auto day = digits(text, 2);
  if (!day || !skip_one_of(text, "T ")) return std::nullopt;
  const auto hour = digits(text, 2);
  if (!hour || !skip_one_of(text, ":")) return std::nullopt;
  const auto minute = digits(text, 2);
  if (!minute || !skip_one_of(text, ":")) return std::nullopt;
  const auto second = digits(text, 2);
  const std::chrono::year_month_day date(std::chrono::year(*year),
                                         std::chrono::month(static_cast<unsigned>(*month)),
                                         std::chrono::day(static_cast<unsigned>(*day)));
  if (!second || !date.ok() || *year < 1970 || *year > 2096 || *hour > 23 || *minute > 59 || *second > 60)
    return std::nullopt;
  std::int64_t nanoseconds = 0;
  if (skip_one_of(text, ".,"))
    for (std::int64_t unit = 100'000'000; !text.empty() && text.front() >= '0' && text.front() <= '9';
         unit /= 10) {
      nanoseconds += unit * (text.front() - '0');
      text.remove_prefix(1);
    }
  int zone_min = 0;
  if (!skip_one_of(text, "Zz") && !text.empty()) {
    const int sign = text.front() == '-' ? -1 : 1;
    if (!skip_one_of(text, "+-")) return std::nullopt;
    const auto hours = digits(text, 2);
    skip_one_of(text, ":");
    const auto minutes = text.empty() ? std::optional(0) : digits(text, 2);
    if (!hours || !minutes) return std::nullopt;
    zone_min = sign * (60 * *hours + *minutes);
  }
  if (!text.empty()) return std::nullopt;
  const std::int64_t days = std::chrono::sys_days(date).time_since_epoch().count();
  return (((days * 24 + *hour) * 60 + *minute - zone_min) * 60 + *second) * 1'000'000'000 + nanoseconds;
}

}  // namespace

std::optional<double> read_value(std::string_view text, bool comma) {
  double value = 0.0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec == std::errc() && read.ptr == end) return value;
  for (const char decimal : {'.', ','}) {
    if (decimal == ',' && !comma) continue;
    const io::Cell cell = io::read_cell(text, decimal);
    if (cell.kind == io::Cell::Kind::number || cell.kind == io::Cell::Kind::missing) return cell.value;
  }
  return std::nullopt;
}

std::optional<std::uint64_t> read_index(std::string_view text) {
  std::uint64_t index = 0;
  const char* const end = text.data() + text.size();
  if (const auto read = std::from_chars(text.data(), end, index); read.ec == std::errc() && read.ptr == end)
    return index;
  const auto value = read_value(text);
  if (!value || !(*value >= 0.0) || *value > 9e15 || *value != std::floor(*value)) return std::nullopt;
  return static_cast<std::uint64_t>(*value);
}

std::optional<std::uint64_t> read_wrapped_index(std::string_view text) {
  constexpr auto kTurn = static_cast<std::int64_t>(kIndexTurn);
  std::int64_t index = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, index);
  if (read.ec != std::errc() || read.ptr != end || index < -kTurn / 2 || index >= kTurn) return std::nullopt;
  return static_cast<std::uint64_t>(index < 0 ? index + kTurn : index);
}

ReadTime read_time(std::string_view text) {
  std::int64_t whole = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, whole);
  const bool exact = read.ec == std::errc() && read.ptr == end;
  const auto value = exact ? std::optional(static_cast<double>(whole)) : read_value(text, true);
  if (!value) {
    const auto time = iso_time(text);
    return {time.has_value(), time};
  }
  for (const TimeUnit& unit : kTimeUnits) {
    if (!(*value >= unit.least)) continue;
    if (*value * unit.nanoseconds > kMostTime) return {};
    if (exact) return {true, whole * static_cast<std::int64_t>(unit.nanoseconds)};
    // whole seconds apart, since a double of nanoseconds is good to 256 ns only
    const double units = std::floor(*value);
    return {true, static_cast<std::int64_t>(units) * static_cast<std::int64_t>(unit.nanoseconds) +
                      std::llround((*value - units) * unit.nanoseconds)};
  }
  return {true, {}};
}

}  // namespace resonid::monitor
