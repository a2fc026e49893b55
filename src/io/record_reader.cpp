// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <resonid/data/detail/second_output.hpp>
#include <resonid/io/record_reader.hpp>
#include <utility>
#include <vector>

#include "io/column_sum.hpp"
#include "io/columns.hpp"
#include "io/missing_samples.hpp"
#include "io/optional_columns.hpp"
#include "io/signal_units.hpp"
#include "io/text.hpp"
#include "io/time_axis.hpp"
#include "io/time_grid.hpp"
#include "io/units.hpp"
#include "io/wrap_around.hpp"

namespace resonid::io {
namespace {

constexpr std::size_t kFewestSamples = 16;
constexpr double kRateAgreement = 0.01;

expected<void, Error> check_options(const ColumnMapping& m) {
  const auto scale = [](double value) { return std::isfinite(value) && value != 0.0; };
  if (!scale(m.input_scale))
    return refuse("input_scale", "must be a finite number other than 0", m.input_scale);
  if (!scale(m.output_scale))
    return refuse("output_scale", "must be a finite number other than 0", m.output_scale);
  if (!scale(m.second_output_scale))
    return refuse("second_output_scale", "must be a finite number other than 0", m.second_output_scale);
  const bool of_a_kind = m.second_output_kind != data::SecondOutput::none;
  if (m.second_output && !of_a_kind)
    return refuse("second_output_kind",
                  "is required with .second_output: what that column measures, load-encoder or "
                  "load-accelerometer");
  if (of_a_kind && !m.second_output)
    return refuse("second_output", "names the column that .second_output_kind is of; it is required with it");
  if (!(m.sample_rate_hz >= 0.0 && std::isfinite(m.sample_rate_hz)))
    return refuse("sample_rate_hz", "must be a number of Hz above 0", m.sample_rate_hz);
  const auto above_zero = [](const std::optional<double>& value) {
    return !value || (*value > 0.0 && std::isfinite(*value));
  };
  if (!above_zero(m.counts_per_rev))
    return refuse("counts_per_rev", "must be a number above 0", *m.counts_per_rev);
  if (!above_zero(m.rated_torque))
    return refuse("rated_torque", "must be a number of Nm (N) above 0", *m.rated_torque);
  if (m.torque_constant && !scale(*m.torque_constant))
    return refuse("torque_constant", "must be a finite number of Nm/A (N/A) other than 0",
                  *m.torque_constant);
  if (m.from_s && m.to_s && !(*m.from_s < *m.to_s))
    return refuse("from_s", fmt::format("must be before .to_s {}", *m.to_s), *m.from_s);
  return {};
}

class RecordMaker {
 public:
  RecordMaker(const Table& table, const ColumnMapping& mapping, FoundColumns found)
      : table_(table), mapping_(mapping), found_(std::move(found)), used_(signal_columns(found_)) {}

  expected<data::Record, Error> make() {
    record_.source = table_.source;
    record_.reading = table_.notes;
    record_.output_quantity = output_quantity(table_, mapping_, found_.output);
    record_.motion = mapping_.motion.value_or(motion());
    if (auto fits = check_quantity(); !fits) return unexpected<Error>(fits.error());
    for (const auto& step : {&RecordMaker::read_time, &RecordMaker::order_rows, &RecordMaker::cut_rows,
                             &RecordMaker::leave_out, &RecordMaker::check_times, &RecordMaker::trim_rows,
                             &RecordMaker::check_length, &RecordMaker::set_rate})
      if (auto done = (this->*step)(); !done) return unexpected<Error>(done.error());
    if (auto filled = fill_channels(); !filled) return unexpected<Error>(filled.error());
    if (mapping_.differentiate) differentiate();
    return std::move(record_);
  }

 private:
  [[nodiscard]] std::string time_name() const { return in_quotes(table_.names[*found_.time]); }
  [[nodiscard]] std::string column_place() const {
    return fmt::format("{}: column {}", table_.source, time_name());
  }
  void note(std::string text) { record_.reading.push_back(std::move(text)); }

  /// As the unit of the output tells, else that of the input; rotary where neither does.
  [[nodiscard]] data::Motion motion() const {
    const auto told = [&](std::size_t column, const std::optional<std::string>& given, bool output) {
      const auto unit = known_unit(given.value_or(named_unit(table_, column).unit));
      const bool fits = unit && quantity_of(unit->dimension).has_value() == output;
      return fits ? motion_of(unit->dimension) : std::nullopt;
    };
    const auto of_input = told(found_.input, mapping_.input_unit, false);
    return told(found_.output, mapping_.output_unit, true).value_or(of_input.value_or(data::Motion::rotary));
  }

  /// A unit that belongs to another quantity than the user says.
  [[nodiscard]] expected<void, Error> check_quantity() {
    if (mapping_.differentiate && record_.output_quantity != data::OutputQuantity::position)
      return refuse("differentiate", "makes a velocity of a position: .output_quantity position is required");
    const std::string unit = named_unit(table_, found_.output).unit;
    const auto known = known_unit(unit);
    if (!known || std::abs(mapping_.output_scale) != 1.0) return {};
    const auto quantity = quantity_of(known->dimension);
    if (quantity && mapping_.output_quantity && *quantity != *mapping_.output_quantity)
      return fail(fmt::format("{}: column {}", table_.source, in_quotes(table_.names[found_.output])),
                  fmt::format("is in {}, the unit of a{} {}; .output_quantity {} contradicts it", unit,
                              *quantity == data::OutputQuantity::acceleration ? "n" : "", name_of(*quantity),
                              name_of(*mapping_.output_quantity)));
    if (!mapping_.output_quantity && record_.output_quantity != data::OutputQuantity::velocity)
      note(fmt::format("the output {} is a{} {}", in_quotes(table_.names[found_.output]),
                       record_.output_quantity == data::OutputQuantity::acceleration ? "n" : "",
                       name_of(record_.output_quantity)));
    return {};
  }

  expected<void, Error> read_time() {
    auto axis = time_axis(table_, mapping_, found_.time, table_.columns[found_.output].size());
    if (!axis) return unexpected<Error>(axis.error());
    axis_ = std::move(*axis);
    for (auto& text : axis_.notes) note(std::move(text));
    return {};
  }

  /// Signals with times of their own must have been sampled together.
  expected<void, Error> check_times() {
    for (std::size_t i = 1; i < found_.times.size(); ++i) {
      const std::size_t column = found_.times[i];
      if (column == *found_.time) continue;
      const auto other = time_axis(table_, mapping_, column, axis_.time_s.size());
      if (!other) return unexpected<Error>(other.error());
      const auto& a = axis_.time_s;
      const auto& b = other->time_s;
      if (a.size() < 3 || b.size() != a.size()) continue;
      const double step = std::abs(a[2] - a[1]);
      double apart = 0.0;
      std::size_t common = 0;
      for (std::size_t k = 0; k < a.size(); ++k) {
        if (std::isnan(a[k]) || std::isnan(b[k])) continue;
        apart = std::max(apart, std::abs(a[k] - b[k]));
        ++common;
      }
      if (apart > 0.5 * step || 10 * common < 9 * a.size())
        return fail(
            table_.source,
            fmt::format(
                "{} and {} were sampled at different times or rates (their times differ by up to {:.3g} s, "
                "{} of {} rows have both); export all signals with one sample time",
                in_quotes(table_.names[used_[0]]), in_quotes(table_.names[used_[i]]), apart, common,
                a.size()));
      if (apart > 0.01 * step)
        note(fmt::format("{} was sampled up to {:.3g} s apart from {}: that is part of the delay",
                         in_quotes(table_.names[used_[i]]), apart, in_quotes(table_.names[used_[0]])));
    }
    return {};
  }

  [[nodiscard]] bool same_samples(std::size_t a, std::size_t b) const {
    return std::all_of(used_.begin(), used_.end(), [&](std::size_t c) {
      const double x = table_.columns[c][a];
      const double y = table_.columns[c][b];
      return x == y || (std::isnan(x) && std::isnan(y));
    });
  }

  /// Keeps the rows that have a time, in rising order, once.
  expected<void, Error> order_rows() {
    std::size_t timeless = 0, twice = 0;
    for (std::size_t row = 0; row < axis_.time_s.size(); ++row) {
      const double t = axis_.time_s[row];
      if (std::isnan(t)) {
        ++timeless;
        continue;
      }
      if (!rows_.empty() && !(t > axis_.time_s[rows_.back()])) {
        const std::size_t before = rows_.back();
        if (t == axis_.time_s[before] && same_samples(row, before)) {
          ++twice;
          continue;
        }
        return not_rising(row, before);
      }
      rows_.push_back(row);
    }
    if (timeless > 0)
      note(fmt::format("{} row{} without a time left out", timeless, timeless == 1 ? "" : "s"));
    if (twice > 0)
      note(fmt::format("{} row{} that stand{} twice left out", twice, twice == 1 ? "" : "s",
                       twice == 1 ? "s" : ""));
    return {};
  }

  [[nodiscard]] unexpected<Error> not_rising(std::size_t row, std::size_t before) const {
    const double now = table_.columns[*found_.time][row];
    const double then = table_.columns[*found_.time][before];
    const bool equal = now == then;
    return fail(fmt::format("{}: {}, column {}", table_.source, table_.place(row), time_name()),
                fmt::format("the time {} {} {} of the sample before it; time must rise{}", now,
                            equal ? "repeats the" : "comes after the later", then,
                            equal ? " (stamps too coarse? then give .sample_rate_hz with .time none)"
                                  : " (two recordings in one file, or a clock that was set? take one part)"));
  }

  /// The first of the rows that is not before `limit_s`; instants that differ by rounding only are the same.
  [[nodiscard]] std::size_t first_from(double limit_s) const {
    const double step = (instant(rows_.size() - 1) - instant(0)) / static_cast<double>(rows_.size() - 1);
    const auto found =
        std::lower_bound(rows_.begin(), rows_.end(), limit_s - 1e-6 * step,
                         [&](std::size_t row, double limit) { return axis_.time_s[row] < limit; });
    return static_cast<std::size_t>(found - rows_.begin());
  }
  [[nodiscard]] double instant(std::size_t i) const { return axis_.time_s[rows_[i]]; }

  expected<void, Error> cut_rows() {
    if (rows_.size() < 2) return {};
    const std::size_t begin = mapping_.from_s ? first_from(*mapping_.from_s) : 0;
    const std::size_t end = mapping_.to_s ? first_from(*mapping_.to_s) : rows_.size();
    if (begin >= end)
      return fail(table_.source,
                  fmt::format("no sample lies in the part chosen with{}{}; the recording spans {} ... {} s",
                              mapping_.from_s ? fmt::format(" .from_s {}", *mapping_.from_s) : "",
                              mapping_.to_s ? fmt::format(" .to_s {}", *mapping_.to_s) : "", instant(0),
                              instant(rows_.size() - 1)));
    cut_ = begin > 0 || end < rows_.size();
    rows_ = std::vector<std::size_t>(rows_.begin() + static_cast<std::ptrdiff_t>(begin),
                                     rows_.begin() + static_cast<std::ptrdiff_t>(end));
    return {};
  }

  /// Signals that are not needed and have too few values.
  expected<void, Error> leave_out() {
    for (auto& text : leave_out_sparse(table_, mapping_, rows_, found_)) note(std::move(text));
    used_ = signal_columns(found_);
    return {};
  }

  [[nodiscard]] bool complete(std::size_t row) const {
    return std::none_of(used_.begin(), used_.end(),
                        [&](std::size_t c) { return std::isnan(table_.columns[c][row]); });
  }

  /// Rows without a value at the beginning and at the end.
  expected<void, Error> trim_rows() {
    const auto whole = [&](std::size_t row) { return complete(row); };
    const auto first = std::find_if(rows_.begin(), rows_.end(), whole);
    const auto last = std::find_if(rows_.rbegin(), rows_.rend(), whole).base();
    if (first >= last) return no_values();
    const std::size_t trimmed = rows_.size() - static_cast<std::size_t>(last - first);
    if (trimmed == 0) return {};
    if (static_cast<double>(trimmed) > 0.5 * static_cast<double>(rows_.size())) return no_values();
    rows_ = std::vector<std::size_t>(first, last);
    note(fmt::format("{} rows at the beginning or end without all signals left out", trimmed));
    return {};
  }

  [[nodiscard]] std::size_t empty_in(std::size_t column) const {
    return static_cast<std::size_t>(std::count_if(rows_.begin(), rows_.end(), [&](std::size_t row) {
      return std::isnan(table_.columns[column][row]);
    }));
  }
  [[nodiscard]] std::size_t worst_column() const {
    return *std::max_element(used_.begin(), used_.end(),
                             [&](std::size_t a, std::size_t b) { return empty_in(a) < empty_in(b); });
  }

  [[nodiscard]] unexpected<Error> no_values() const {
    const std::size_t worst = worst_column();
    const std::size_t most = empty_in(worst);
    return fail(fmt::format("{}: column {}", table_.source, in_quotes(table_.names[worst])),
                fmt::format("has no value in {} of {} rows; export all signals with one sample time", most,
                            rows_.size()));
  }

  expected<void, Error> check_length() {
    if (rows_.size() >= kFewestSamples + (mapping_.differentiate ? 1 : 0)) return {};
    return fail(table_.source,
                fmt::format("has {} samples{}; at least {} are required", rows_.size(),
                            cut_ ? " in the part chosen with .from_s and .to_s" : "", kFewestSamples));
  }

  expected<void, Error> set_rate() {
    record_.sample_rate_hz = axis_.sample_rate_hz > 0.0 ? axis_.sample_rate_hz : mapping_.sample_rate_hz;
    std::vector<double> times;
    for (const std::size_t row : rows_) times.push_back(axis_.time_s[row]);
    record_.start_time_s = times.front();
    grid_.index.resize(rows_.size());
    for (std::size_t i = 0; i < rows_.size(); ++i) grid_.index[i] = rows_[i] - rows_.front();
    if (!axis_.measured) return {};
    grid_ = fit_time_grid(times);
    if (!std::isnormal(grid_.sample_rate_hz))
      return fail(column_place(),
                  fmt::format("stamps from {} to {} give no sample rate; they must be the time in seconds",
                              times.front(), times.back()));
    const double given = mapping_.sample_rate_hz;
    if (given > 0.0 && std::abs(grid_.sample_rate_hz - given) > kRateAgreement * given)
      return fail(
          table_.source,
          fmt::format(".sample_rate_hz {} contradicts the time column {}, which says {:.6g} Hz; leave one of "
                      "them out (.time none ignores the column)",
                      given, time_name(), grid_.sample_rate_hz));
    if (record_.sample_rate_hz == 0.0) record_.sample_rate_hz = grid_.sample_rate_hz;
    record_.sampling = grid_.sampling;
    record_.sampling.time_name = table_.names[*found_.time];
    return {};
  }

  /// Places of the grid at which a signal has no value.
  [[nodiscard]] std::vector<std::size_t> missing_places() const {
    std::vector<std::size_t> missing;
    std::size_t next = 0;
    for (std::size_t i = 0; i < rows_.size() && !grid_.index.empty(); ++i) {
      for (; next < grid_.index[i]; ++next) missing.push_back(next);
      if (!complete(rows_[i])) missing.push_back(next);
      ++next;
    }
    return missing;
  }

  /// How many samples there would be if none were missing.
  [[nodiscard]] std::size_t complete_size() const {
    return grid_.index.empty() ? rows_.size() + grid_.missing : grid_.index.back() + 1;
  }

  [[nodiscard]] unexpected<Error> too_many_missing(std::size_t missing) const {
    const std::string how =
        grid_.sampling.gaps == 0
            ? fmt::format("cells without a number, most in {}", in_quotes(table_.names[worst_column()]))
            : fmt::format("in {} gaps, the first after {} s", grid_.sampling.gaps,
                          grid_.sampling.first_gap_at_s);
    return fail(
        found_.time ? column_place() : table_.source,
        fmt::format(
            "{} of {} samples are missing ({:.1f} %, {}); at most {} % may be; choose an unbroken part "
            "with .from_s and .to_s",
            missing, complete_size(),
            100.0 * static_cast<double>(missing) / static_cast<double>(complete_size()), how,
            100.0 * kMostMissing));
  }

  /// Takes the samples: all of them, on the complete grid where few are missing.
  expected<void, Error> fill_channels() {
    const std::size_t cells = grid_.index.empty() ? 0 : missing_count();
    const std::size_t missing = grid_.missing + cells;
    const double share = static_cast<double>(missing) / static_cast<double>(complete_size());
    if (share > kMostMissing || (missing > 0 && grid_.index.empty())) return too_many_missing(missing);
    if (missing > 0) {
      auto places = missing_places();
      const std::size_t run = longest_run(places);
      if (mapping_.missing == MissingSamples::refuse)
        return fail(
            fmt::format("{}: {}", table_.source, table_.place(row_at(places.front()))),
            fmt::format("{} of {} samples are missing, the first at or after this row; .missing refuse "
                        "allows none",
                        missing, complete_size()));
      if (share <= kMostFilled && run <= kLongestFilled) {
        note(fmt::format("{} of {} samples ({:.2g} %) were missing and are interpolated", missing,
                         complete_size(), 100.0 * share));
        fill_ = true;
        record_.sampling.filled = std::move(places);
        record_.sampling.gaps = 0;
        record_.sampling.largest_gap_s = record_.sampling.first_gap_at_s = 0.0;
      } else {
        drop_incomplete();
      }
    }
    make_channels();
    return {};
  }

  /// The row at a place of the grid, or the last one before it.
  [[nodiscard]] std::size_t row_at(std::size_t place) const {
    const auto after = std::upper_bound(grid_.index.begin(), grid_.index.end(), place);
    return rows_[static_cast<std::size_t>(std::max<std::ptrdiff_t>(1, after - grid_.index.begin()) - 1)];
  }

  [[nodiscard]] std::size_t missing_count() const {
    return static_cast<std::size_t>(
        std::count_if(rows_.begin(), rows_.end(), [&](std::size_t row) { return !complete(row); }));
  }

  /// More are missing than may be filled: what is left stands next to each other, and the gaps are told.
  void drop_incomplete() {
    std::vector<std::size_t> kept;
    data::Sampling& s = record_.sampling;
    s.gaps = 0;
    s.largest_gap_s = s.first_gap_at_s = 0.0;
    s.measured = true;
    std::size_t last = 0;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!complete(rows_[i])) continue;
      if (!kept.empty() && grid_.index[i] > grid_.index[last] + 1) {
        const double gap = static_cast<double>(grid_.index[i] - grid_.index[last]) / record_.sample_rate_hz;
        if (s.gaps++ == 0) s.first_gap_at_s = axis_.time_s[rows_[last]];
        s.largest_gap_s = std::max(s.largest_gap_s, gap);
      }
      kept.push_back(rows_[i]);
      last = i;
    }
    rows_ = std::move(kept);
  }

  /// The samples of a column that are there and, where few are missing, their places on the grid.
  [[nodiscard]] std::vector<double> present_samples(std::size_t column, std::vector<std::size_t>& at) const {
    const auto& all = table_.columns[column];
    std::vector<double> values;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (fill_ && std::isnan(all[rows_[i]])) continue;
      values.push_back(all[rows_[i]]);
      if (fill_) at.push_back(grid_.index[i]);
    }
    return values;
  }

  /// The samples of a column without its wrap-around, on the complete grid where few are missing.
  [[nodiscard]] std::vector<double> samples_of(std::size_t column, const std::string& unit) {
    std::vector<std::size_t> at;
    auto values = present_samples(column, at);
    undo_wrap_around(column, unit, at, values);
    return fill_ ? interpolated(values, at, complete_size()) : values;
  }

  void undo_wrap_around(std::size_t column, const std::string& unit, const std::vector<std::size_t>& at,
                        std::vector<double>& values) {
    const auto known = known_unit(unit);
    const bool output = column == found_.output && record_.output_quantity == data::OutputQuantity::position;
    if (!output && !(known && quantity_of(known->dimension) == data::OutputQuantity::position)) return;
    WrapRanges ranges;
    ranges.counts = known && known->dimension == Dimension::counts;
    if (ranges.counts && mapping_.counts_per_rev) ranges.known.push_back(*mapping_.counts_per_rev);
    if (known && known->dimension == Dimension::angle)
      ranges.known.push_back(2.0 * std::numbers::pi / known->factor);
    // A reference may step; it wraps around where the output does.
    ranges.any = column != found_.reference;
    if (!ranges.any && wrap_range_ > 0.0) ranges.known.push_back(wrap_range_);
    const auto unwrapped = unwrap(values, at, ranges);
    if (!unwrapped) return;
    if (column == found_.output) wrap_range_ = unwrapped->range;
    const int digits = unwrapped->range == std::round(unwrapped->range) ? 10 : 6;
    note(fmt::format("{}: wrap-around at {:.{}g}{}{} undone ({} times)", in_quotes(table_.names[column]),
                     unwrapped->range, digits, unit.empty() ? "" : " " + unit,
                     unwrapped->estimated ? ", found from the jumps," : "", unwrapped->jumps));
  }

  /// `unit`: of the column's numbers, where its name does not tell.
  [[nodiscard]] data::Channel channel(std::size_t column, const Conversion& conversion,
                                      const std::string& unit = {}) {
    const std::string named = named_unit(table_, column).unit;
    data::Channel result{table_.names[column], conversion.unit,
                         samples_of(column, named.empty() ? unit : named), conversion.assumed};
    if (conversion.factor != 1.0)
      for (double& sample : result.samples) sample *= conversion.factor;
    return result;
  }

  /// A signal that is added to or compared with another one in the drive (ru with u, r with y), and so is
  /// scaled like it, unless its name tells a unit of its own.
  [[nodiscard]] data::Channel companion(UnitConverter& converter, std::size_t column, std::size_t main_column,
                                        const data::Channel& main, const Conversion& like, double scale) {
    const std::string own = named_unit(table_, column).unit;
    const std::string of_main = named_unit(table_, main_column).unit;
    const auto known = known_unit(own);
    const bool in_unit_of_main = known && own != of_main && base_unit(known->dimension) == main.unit;
    if (in_unit_of_main)
      return channel(
          column, converter.convert({table_.names[column], own, {}, std::copysign(1.0, scale), main.unit}));
    if (own.empty() || own == of_main || std::abs(scale) != 1.0) return channel(column, like);
    return channel(column, converter.convert({table_.names[column], own, {}, scale, main.unit}));
  }

  /// The unit of the output as the file tells it; of a position without one what it wraps around at tells:
  /// 360 of anything are degrees, whole numbers are counts.
  [[nodiscard]] std::string output_unit() {
    const std::string unit = named_unit(table_, found_.output).unit;
    if (!unit.empty() || mapping_.output_unit || std::abs(mapping_.output_scale) != 1.0 ||
        record_.output_quantity != data::OutputQuantity::position)
      return unit;
    std::vector<std::size_t> at;
    auto values = present_samples(found_.output, at);
    const auto unwrapped = unwrap(values, at, {.known = {2.0 * std::numbers::pi}, .any = true});
    if (!unwrapped || unwrapped->range != std::round(unwrapped->range)) return unit;
    const bool degrees = unwrapped->range == 360.0;
    if (!degrees && !unwrapped->whole) return unit;
    const std::string told = degrees ? "deg" : "counts";
    note(fmt::format("no unit in {}: {} assumed, as it wraps around at {:.10g}",
                     in_quotes(table_.names[found_.output]), told, unwrapped->range));
    return told;
  }

  /// What an output that is a position is in, where its name does not tell.
  [[nodiscard]] std::string position_unit() const {
    if (record_.output_quantity != data::OutputQuantity::position || std::abs(mapping_.output_scale) != 1.0)
      return {};
    if (mapping_.output_unit && !mapping_.differentiate) return *mapping_.output_unit;
    return output_si_unit(record_.motion, record_.output_quantity);
  }

  void make_channels() {
    const auto& m = mapping_;
    UnitConverter converter(m, record_.motion, record_.reading);
    const auto unit_of = [&](std::size_t column) { return named_unit(table_, column).unit; };
    const std::string output_si = output_si_unit(record_.motion, record_.output_quantity);
    const bool current = sense_of_column(table_, found_.input).kind == SignalSense::Kind::current &&
                         std::abs(m.input_scale) == 1.0;
    const Conversion u = converter.convert({table_.names[found_.input], unit_of(found_.input), m.input_unit,
                                            m.input_scale, current ? "A" : input_si_unit(record_.motion)});
    record_.input = channel(found_.input, u);
    const std::string told = output_unit();
    const Conversion y =
        converter.convert({table_.names[found_.output], told, m.output_unit, m.output_scale, output_si,
                           m.output_quantity ? std::string(name_of(*m.output_quantity)) : ""});
    record_.output = channel(found_.output, y, told.empty() ? position_unit() : told);
    if (found_.excitation)
      record_.excitation =
          companion(converter, *found_.excitation, found_.input, record_.input, u, m.input_scale);
    if (found_.reference)
      record_.reference =
          companion(converter, *found_.reference, found_.output, record_.output, y, m.output_scale);
    if (found_.position) {
      const std::string si = output_si_unit(record_.motion, data::OutputQuantity::position);
      const std::string unit = unit_of(*found_.position);
      record_.position =
          channel(*found_.position,
                  unit.empty() ? Conversion{1.0, si}
                               : converter.convert({table_.names[*found_.position], unit, {}, 1.0, si}),
                  si);
    }
    if (found_.second_output) {
      const std::string si = output_si_unit(record_.motion, data::quantity_of(m.second_output_kind));
      record_.second_output =
          channel(*found_.second_output,
                  converter.convert({table_.names[*found_.second_output], unit_of(*found_.second_output),
                                     m.second_output_unit, m.second_output_scale, si}));
      record_.second_output_kind = m.second_output_kind;
    }
  }

  /// Backward differences, from the second sample on.
  void differentiate() {
    for (auto* channel : {&record_.output, &record_.reference}) {
      auto& x = channel->samples;
      for (std::size_t k = x.size(); k-- > 1;) x[k] = (x[k] - x[k - 1]) * record_.sample_rate_hz;
      if (channel->present() && !mapping_.output_unit) channel->unit += "/s";
    }
    record_.start_time_s += record_.sample_time_s();
    for (auto* channel : {&record_.input, &record_.output, &record_.excitation, &record_.reference,
                          &record_.position, &record_.second_output})
      if (channel->present()) channel->samples.erase(channel->samples.begin());
    auto& filled = record_.sampling.filled;
    std::erase(filled, std::size_t{0});
    for (std::size_t& place : filled) --place;
    record_.output_quantity = data::OutputQuantity::velocity;
  }

  const Table& table_;
  const ColumnMapping& mapping_;
  FoundColumns found_;
  std::vector<std::size_t> used_;  // columns of signals
  TimeAxis axis_;
  std::vector<std::size_t> rows_;  // of the table, that are taken
  TimeGrid grid_;                  // index: of the rows
  double wrap_range_ = 0.0;        // of the output
  bool cut_ = false;
  bool fill_ = false;
  data::Record record_;
};

}  // namespace

expected<data::Record, Error> to_record(const Table& table, const ColumnMapping& mapping) {
  if (auto options = check_options(mapping); !options) return unexpected<Error>(options.error());
  const auto sums = add_sums(table, mapping);
  if (!sums) return unexpected<Error>(sums.error());
  const Table& columns = *sums ? (*sums)->table : table;
  const ColumnMapping& names = *sums ? (*sums)->mapping : mapping;
  const auto found = find_columns(columns, names);
  if (!found) return unexpected<Error>(found.error());
  return RecordMaker(columns, names, *found).make();
}

expected<data::Record, Error> read_record(const std::filesystem::path& path, const ColumnMapping& mapping) {
  const auto table = read_table(path, mapping.layout);
  if (!table) return unexpected<Error>(table.error());
  return to_record(*table, mapping);
}

}  // namespace resonid::io
