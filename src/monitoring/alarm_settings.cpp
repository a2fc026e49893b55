// SPDX-License-Identifier: MIT
#include <cmath>
#include <monitoring/alarm_settings.hpp>
#include <optional>
#include <string>
#include <string_view>

namespace resonid::monitoring {
namespace {

bool counts_as_time(double seconds) noexcept { return seconds >= 0.0 && std::isfinite(seconds); }

/// Checks each described table of an axis and keeps the first fault.
struct CheckTables {
  std::optional<Error>& fault;
  template <class Table>
  void operator()(std::string_view name, Table& table, std::string_view) const {
    if (fault) return;
    if (const auto fine = check(table); !fine) {
      fault = fine.error();
      fault->field = std::string(name) + "." + fault->field.str();
    }
  }
};

}  // namespace

expected<void, Error> check(const AlarmSettings& settings) noexcept {
  if (!counts_as_time(settings.on_delay_s)) return refuse("on_delay_s", "must be >= 0", settings.on_delay_s);
  if (!counts_as_time(settings.off_delay_s))
    return refuse("off_delay_s", "must be >= 0", settings.off_delay_s);
  if (!counts_as_time(settings.realarm_s)) return refuse("realarm_s", "must be >= 0", settings.realarm_s);
  if (!counts_as_time(settings.longest_shelving_s) || settings.longest_shelving_s == 0.0)
    return refuse("longest_shelving_s", "must be > 0", settings.longest_shelving_s);
  return {};
}

expected<void, Error> check(const FigureAlarmSettings& settings) noexcept {
  if (auto fine = check(settings.alarm); !fine) return fine;
  if (!(settings.least_change >= 0.0) || !std::isfinite(settings.least_change))
    return refuse("least_change", "must be >= 0", settings.least_change);
  if (std::isnan(settings.low) || std::isnan(settings.high) || !(settings.low < settings.high))
    return refuse("low", "must be below high", settings.low);
  if (!(settings.deadband >= 0.0) || !std::isfinite(settings.deadband))
    return refuse("deadband", "must be >= 0", settings.deadband);
  if (!(2.0 * settings.deadband < settings.high - settings.low))  // else nothing between them clears it
    return refuse("deadband", "must be below half the distance of high and low", settings.deadband);
  return {};
}

expected<void, Error> check(const AxisAlarmSettings& settings) {
  std::optional<Error> fault;
  AxisAlarmSettings tables = settings;
  describe(CheckTables{fault}, tables);
  if (fault) return unexpected<Error>(*fault);
  return {};
}

}  // namespace resonid::monitoring
