// SPDX-License-Identifier: MIT
#include "io/time_axis.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>

#include "io/columns.hpp"
#include "io/text.hpp"

namespace resonid::io {
namespace {

constexpr double kSlowestTold = 5.0;   // Hz, of a column that says its unit
constexpr double kSlowest = 60.0;      // Hz; no drive is recorded more slowly
constexpr double kFastest = 1e7;       // Hz
constexpr double kFiletime = 5e16;     // 100 ns since 1601; after 1759
constexpr double kNanoseconds = 3e17;  // since 1970; after 1979
constexpr double kMicroseconds = 3e14;
constexpr double kMilliseconds = 3e11;

double seconds_in(TimeUnit unit) {
  switch (unit) {
    case TimeUnit::milliseconds:
      return 1e-3;
    case TimeUnit::microseconds:
      return 1e-6;
    case TimeUnit::nanoseconds:
      return 1e-9;
    case TimeUnit::hundred_nanoseconds:
      return 1e-7;
    default:
      return 1.0;
  }
}

class TimeReader {
 public:
  TimeReader(const Table& table, const ColumnMapping& mapping, std::size_t rows)
      : table_(table), mapping_(mapping), rows_(rows) {}

  expected<TimeAxis, Error> counted() {
    axis_.sample_rate_hz = rate();
    if (axis_.sample_rate_hz == 0.0) return no_time();
    for (std::size_t k = 0; k < rows_; ++k)
      axis_.time_s.push_back(static_cast<double>(k) / axis_.sample_rate_hz);
    return std::move(axis_);
  }

  expected<TimeAxis, Error> read(std::size_t column) {
    const auto& stamps = table_.columns[column];
    name_ = in_quotes(table_.names[column]);
    const bool numbers = mapping_.time_unit
                             ? *mapping_.time_unit == TimeUnit::samples
                             : sense_of_column(table_, column).kind == SignalSense::Kind::sample_number;
    if (numbers) return read_numbers(stamps);
    const auto factor = factor_of(column, stamps);
    if (!factor) return unexpected<Error>(factor.error());
    axis_.measured = true;
    axis_.time_s = stamps;
    const double first = first_of(stamps);
    const bool since_long = std::abs(first * *factor) > 1e8;  // years: keep the digits for what differs
    for (double& t : axis_.time_s) t = (since_long ? t - first : t) * *factor;
    if (since_long)
      axis_.notes.push_back(fmt::format("the time begins with 0 at the first stamp of {}", name_));
    return std::move(axis_);
  }

 private:
  /// As told, or as the file says.
  double rate() {
    if (mapping_.sample_rate_hz > 0.0) return mapping_.sample_rate_hz;
    if (table_.sample_interval_s > 0.0) {
      axis_.notes.push_back(
          fmt::format("sample interval {:g} s as the lines above the samples say", table_.sample_interval_s));
      return 1.0 / table_.sample_interval_s;
    }
    for (const auto& scalar : table_.scalars) {
      const std::string name = lower(scalar.name);
      constexpr std::array<std::string_view, 5> kIntervals = {"ts", "dt", "sample_time", "sampletime", "t_s"};
      constexpr std::array<std::string_view, 4> kRates = {"fs", "rate", "sample_rate", "samplerate"};
      const bool interval = std::find(kIntervals.begin(), kIntervals.end(), name) != kIntervals.end();
      const bool is_rate = std::find(kRates.begin(), kRates.end(), name) != kRates.end();
      const double hz = interval ? 1.0 / scalar.value : scalar.value;
      if (!(interval || is_rate) || !(hz > 0.0) || !std::isfinite(hz)) continue;
      axis_.notes.push_back(
          fmt::format("sample rate {:g} Hz as the variable {} says", hz, in_quotes(scalar.name)));
      return hz;
    }
    return 0.0;
  }

  [[nodiscard]] unexpected<Error> no_time() const {
    std::string scalars;
    for (const auto& scalar : table_.scalars) scalars += fmt::format(" {} = {}", scalar.name, scalar.value);
    std::string times;
    for (const auto& variable : table_.unusable)
      if (sense_of(take_apart(variable.name).base, std::nullopt).kind == SignalSense::Kind::time)
        times += fmt::format("; {} {}", in_quotes(variable.name), variable.reason);
    return fail(table_.source,
                fmt::format("the sample rate is not known: no column is called 't' or 'time'; give .time or "
                            ".sample_rate_hz{}{}{}; columns: {}",
                            times, scalars.empty() ? "" : "; the file holds", scalars, listed(table_.names)));
  }

  expected<TimeAxis, Error> read_numbers(const std::vector<double>& stamps) {
    const double hz = rate();
    if (hz == 0.0)
      return fail(fmt::format("{}: column {}", table_.source, name_),
                  "holds sample numbers, which tell no time; give .sample_rate_hz");
    axis_.measured = true;
    axis_.time_s = stamps;
    for (double& t : axis_.time_s) t /= hz;
    axis_.notes.push_back(fmt::format("{} counts samples, {:g} Hz", name_, hz));
    return std::move(axis_);
  }

  [[nodiscard]] expected<double, Error> factor_of(std::size_t column, const std::vector<double>& stamps) {
    const std::string unit = named_unit(table_, column).unit;
    if (mapping_.time_unit) return seconds_in(*mapping_.time_unit);
    const double first = std::abs(first_of(stamps));
    const auto since = [&](const char* what, double factor) {
      axis_.notes.push_back(fmt::format("{} holds {}", name_, what));
      return factor;
    };
    if (first > kNanoseconds && first < 1e19) return since("nanoseconds since 1970", 1e-9);
    if (first > kFiletime && first < kNanoseconds) return since("FILETIME stamps, 100 ns since 1601", 1e-7);
    const auto known = known_unit(unit);
    if (!unit.empty() && known && known->dimension != Dimension::time)
      return fail(
          fmt::format("{}: column {}", table_.source, name_),
          fmt::format("is in {}, which is no time; name another one with .time, or give .sample_rate_hz",
                      unit));
    if (known && known->factor != 1.0) {
      axis_.notes.push_back(fmt::format("{}: {} converted to s", name_, unit));
      return plausible(stamps, known->factor, unit);
    }
    if (unit.empty() || !known) {
      if (first > kMicroseconds) return since("microseconds since 1970", 1e-6);
      if (first > kMilliseconds) return since("milliseconds since 1970", 1e-3);
    }
    if (unit.empty()) axis_.notes.push_back(fmt::format("no unit in {}: s assumed", name_));
    return plausible(stamps, 1.0, unit);
  }

  /// The first that is there.
  static double first_of(const std::vector<double>& stamps) {
    const auto found = std::find_if(stamps.begin(), stamps.end(), [](double t) { return !std::isnan(t); });
    return found == stamps.end() ? 0.0 : *found;
  }

  /// Milliseconds taken for seconds give a rate below 1 Hz.
  [[nodiscard]] expected<double, Error> plausible(const std::vector<double>& stamps, double factor,
                                                  const std::string& unit) const {
    std::vector<double> steps;
    for (std::size_t k = 1; k < stamps.size(); ++k)
      if (stamps[k] > stamps[k - 1]) steps.push_back(factor * (stamps[k] - stamps[k - 1]));
    if (steps.size() < 2) return factor;
    const double hz = 1.0 / median(std::move(steps));
    const bool whole = std::all_of(stamps.begin(), stamps.end(),
                                   [](double t) { return std::isnan(t) || t == std::round(t); });
    if (hz < (unit.empty() ? kSlowest : kSlowestTold))
      return fail(
          fmt::format("{}: column {}", table_.source, name_),
          fmt::format(
              "gives a sample rate of {:.3g} Hz when its numbers are {}: no drive is recorded so slowly. "
              "They are milliseconds, microseconds{}: give .time_unit ms, us{} (.time_unit s if they "
              "are seconds indeed)",
              hz, unit.empty() ? "seconds" : unit, whole ? " or sample numbers" : "",
              whole ? " or samples" : ""));
    if (hz > kFastest)
      return fail(fmt::format("{}: column {}", table_.source, name_),
                  fmt::format("gives a sample rate of {:.3g} Hz when its numbers are {}; give .time_unit", hz,
                              unit.empty() ? "seconds" : unit));
    return factor;
  }

  const Table& table_;
  const ColumnMapping& mapping_;
  std::size_t rows_;
  std::string name_;
  TimeAxis axis_;
};

}  // namespace

expected<TimeAxis, Error> time_axis(const Table& table, const ColumnMapping& mapping,
                                    const std::optional<std::size_t>& column, std::size_t rows) {
  TimeReader reader(table, mapping, rows);
  return column ? reader.read(*column) : reader.counted();
}

}  // namespace resonid::io
