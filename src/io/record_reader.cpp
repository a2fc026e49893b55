// SPDX-License-Identifier: MIT
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <resonid/data/detail/second_output.hpp>
#include <resonid/io/record_reader.hpp>
#include <span>

#include "io/column_sum.hpp"
#include "io/columns.hpp"
#include "io/text.hpp"
#include "io/time_grid.hpp"
#include "io/units.hpp"

namespace resonid::io {
namespace {

constexpr std::size_t kFewestSamples = 16;
constexpr double kMostMissing = 0.05;
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
  if (m.differentiate && m.output_quantity != data::OutputQuantity::position)
    return refuse("differentiate", "makes a velocity of a position: .output_quantity position is required");
  if (m.from_s && m.to_s && !(*m.from_s < *m.to_s))
    return refuse("from_s", fmt::format("must be before .to_s {}", *m.to_s), *m.from_s);
  return {};
}

/// The rows [begin, end) that are taken.
struct Rows {
  std::size_t begin = 0;
  std::size_t end = 0;
  [[nodiscard]] std::size_t size() const noexcept { return end - begin; }
};

class RecordMaker {
 public:
  RecordMaker(const Table& table, const ColumnMapping& mapping, const FoundColumns& found)
      : table_(table), mapping_(mapping), found_(found) {}

  expected<data::Record, Error> make() {
    record_.source = table_.source;
    record_.output_quantity = mapping_.output_quantity;
    record_.motion = mapping_.motion;
    const std::size_t samples = table_.columns[found_.output].size();
    if (!found_.time && mapping_.sample_rate_hz == 0.0) return no_time();
    if (auto rising = check_time(); !rising) return unexpected<Error>(rising.error());
    rows_ = {0, samples};
    if (auto cut = cut_rows(); !cut) return unexpected<Error>(cut.error());
    if (rows_.size() < kFewestSamples + (mapping_.differentiate ? 1 : 0))
      return fail(table_.source,
                  fmt::format("has {} samples{}; at least {} are required", rows_.size(),
                              rows_.size() == samples ? "" : " in the part chosen with .from_s and .to_s",
                              kFewestSamples));
    if (auto rate = set_rate(); !rate) return unexpected<Error>(rate.error());
    fill_channels();
    if (mapping_.differentiate) differentiate();
    return std::move(record_);
  }

 private:
  [[nodiscard]] const std::vector<double>& time() const { return table_.columns[*found_.time]; }
  [[nodiscard]] std::string time_name() const { return in_quotes(table_.names[*found_.time]); }

  [[nodiscard]] unexpected<Error> no_time() const {
    std::string scalars;
    for (const auto& scalar : table_.scalars) scalars += fmt::format(" {} = {}", scalar.name, scalar.value);
    return fail(table_.source,
                fmt::format("the sample rate is not known: no column is called 't' or 'time'; give .time or "
                            ".sample_rate_hz{}{}; columns: {}",
                            scalars.empty() ? "" : "; the file holds", scalars, listed(table_.names)));
  }

  [[nodiscard]] expected<void, Error> check_time() const {
    if (!found_.time) return {};
    const auto bad = first_not_rising(time());
    if (!bad) return {};
    const bool equal = time()[*bad] == time()[*bad - 1];
    return fail(fmt::format("{}: {}, column {}", table_.source, table_.place(*bad), time_name()),
                fmt::format("the time {} {} {} of the sample before it; time must rise{}", time()[*bad],
                            equal ? "repeats the" : "comes after the later", time()[*bad - 1],
                            equal ? " (stamps too coarse? then give .sample_rate_hz with .time none)" : ""));
  }

  [[nodiscard]] double instant(std::size_t row) const {
    return found_.time ? time()[row] : static_cast<double>(row) / mapping_.sample_rate_hz;
  }

  /// The first row that is not before `limit_s`; instants that differ by rounding only are the same.
  [[nodiscard]] std::size_t first_from(double limit_s) const {
    const double step = (instant(rows_.end - 1) - instant(0)) / static_cast<double>(rows_.end - 1);
    std::size_t low = 0;
    std::size_t high = rows_.end;
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      if (instant(middle) < limit_s - 1e-6 * step) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  expected<void, Error> cut_rows() {
    if (rows_.end < 2) return {};
    const Rows all = rows_;
    const std::size_t begin = mapping_.from_s ? first_from(*mapping_.from_s) : all.begin;
    const std::size_t end = mapping_.to_s ? first_from(*mapping_.to_s) : all.end;
    if (begin >= end)
      return fail(table_.source,
                  fmt::format("no sample lies in the part chosen with{}{}; the record spans {} ... {} s",
                              mapping_.from_s ? fmt::format(" .from_s {}", *mapping_.from_s) : "",
                              mapping_.to_s ? fmt::format(" .to_s {}", *mapping_.to_s) : "",
                              instant(all.begin), instant(all.end - 1)));
    rows_ = {begin, end};
    return {};
  }

  expected<void, Error> set_rate() {
    record_.start_time_s = instant(rows_.begin);
    record_.sample_rate_hz = mapping_.sample_rate_hz;
    if (!found_.time) return {};
    const TimeGrid grid = fit_time_grid(std::span(time()).subspan(rows_.begin, rows_.size()));
    if (!std::isnormal(grid.sample_rate_hz))
      return fail(fmt::format("{}: column {}", table_.source, time_name()),
                  fmt::format("stamps from {} to {} give no sample rate; they must be the time in seconds",
                              instant(rows_.begin), instant(rows_.end - 1)));
    const double given = mapping_.sample_rate_hz;
    if (given > 0.0 && std::abs(grid.sample_rate_hz - given) > kRateAgreement * given)
      return fail(
          table_.source,
          fmt::format(".sample_rate_hz {} contradicts the time column {}, which says {:.6g} Hz; leave one of "
                      "them out (.time none ignores the column)",
                      given, time_name(), grid.sample_rate_hz));
    const auto complete = static_cast<double>(rows_.size() + grid.missing);
    const double missing = static_cast<double>(grid.missing) / complete;
    if (missing > kMostMissing)
      return fail(fmt::format("{}: column {}", table_.source, time_name()),
                  fmt::format("{} of {} samples are missing ({:.1f} %, in {} gaps, the first after {} "
                              "s); at most {} % may be; choose an unbroken part with .from_s and .to_s",
                              grid.missing, rows_.size() + grid.missing, 100.0 * missing, grid.sampling.gaps,
                              grid.sampling.first_gap_at_s, 100.0 * kMostMissing));
    if (given == 0.0) record_.sample_rate_hz = grid.sample_rate_hz;
    record_.sampling = grid.sampling;
    return {};
  }

  [[nodiscard]] data::Channel channel(std::size_t column, double scale, std::string unit) const {
    data::Channel result{table_.names[column], std::move(unit), {}};
    const auto first = table_.columns[column].begin() + static_cast<std::ptrdiff_t>(rows_.begin);
    result.samples.assign(first, first + static_cast<std::ptrdiff_t>(rows_.size()));
    if (scale != 1.0)
      for (double& sample : result.samples) sample *= scale;
    return result;
  }

  /// Unit of a signal after scaling: given, or SI when a factor other than a sign was applied, or as the name
  /// says, or SI.
  static std::string scaled_unit(const std::optional<std::string>& given, double scale,
                                 const std::string& named, const std::string& si) {
    if (given) return *given;
    return std::abs(scale) != 1.0 || named.empty() ? si : named;
  }

  /// A signal that is added to or compared with another one in the drive (ru with u, r with y), and so is
  /// scaled like it, unless its name says that it already has the unit that the other one gets.
  [[nodiscard]] data::Channel companion(std::size_t column, const data::Channel& main, double scale) const {
    const std::string own = take_apart(table_.names[column]).unit;
    const bool converted = own == main.unit && own != take_apart(main.name).unit;
    const bool keeps_own = converted || (std::abs(scale) == 1.0 && !own.empty());
    return channel(column, converted ? 1.0 : scale, keeps_own ? own : main.unit);
  }

  void fill_channels() {
    const auto& m = mapping_;
    const std::string input_named = take_apart(table_.names[found_.input]).unit;
    std::string output_named = take_apart(table_.names[found_.output]).unit;
    const std::string output_si = output_si_unit(m.motion, m.output_quantity);
    if (output_named == "m" && output_si != "m") output_named.clear();  // "omega_m": of the motor, measured
    record_.input = channel(found_.input, m.input_scale,
                            scaled_unit(m.input_unit, m.input_scale, input_named, input_si_unit(m.motion)));
    record_.output = channel(found_.output, m.output_scale,
                             scaled_unit(m.output_unit, m.output_scale, output_named, output_si));
    if (found_.excitation) record_.excitation = companion(*found_.excitation, record_.input, m.input_scale);
    if (found_.reference) record_.reference = companion(*found_.reference, record_.output, m.output_scale);
    if (found_.position) {
      const std::string named = take_apart(table_.names[*found_.position]).unit;
      const std::string si = output_si_unit(m.motion, data::OutputQuantity::position);
      record_.position = channel(*found_.position, 1.0, named.empty() ? si : named);
    }
    if (found_.second_output) {
      const std::string named = take_apart(table_.names[*found_.second_output]).unit;
      const std::string si = output_si_unit(m.motion, data::quantity_of(m.second_output_kind));
      record_.second_output = channel(*found_.second_output, m.second_output_scale,
                                      scaled_unit(m.second_output_unit, m.second_output_scale, named, si));
      record_.second_output_kind = m.second_output_kind;
    }
    if (found_.time) record_.sampling.time_name = table_.names[*found_.time];
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
    record_.output_quantity = data::OutputQuantity::velocity;
  }

  const Table& table_;
  const ColumnMapping& mapping_;
  const FoundColumns& found_;
  Rows rows_;
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
  const auto table = read_table(path);
  if (!table) return unexpected<Error>(table.error());
  return to_record(*table, mapping);
}

}  // namespace resonid::io
