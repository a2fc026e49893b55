// SPDX-License-Identifier: MIT
#include "io/columns.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

#include "io/text.hpp"
#include "io/units.hpp"

namespace resonid::io {
namespace {

/// The usual names of a signal, in lower case and without a unit.
struct Usual {
  std::string_view option;                  ///< The option that names the column.
  std::string_view signal;                  ///< As a word of a message.
  std::vector<std::string_view> whole;      ///< The whole name.
  std::vector<std::string_view> beginning;  ///< What the name begins with.
};

std::string names_of(const Usual& usual) {
  std::string text;
  for (const auto name : usual.whole) text += fmt::format("{}'{}'", text.empty() ? "" : ", ", name);
  for (const auto name : usual.beginning) text += fmt::format("{}'{}...'", text.empty() ? "" : ", ", name);
  return text;
}

bool is_usual(const Usual& usual, const std::string& name) {
  const std::string base = lower(name);
  const auto begins = [&](std::string_view start) { return base.compare(0, start.size(), start) == 0; };
  return std::find(usual.whole.begin(), usual.whole.end(), base) != usual.whole.end() ||
         std::any_of(usual.beginning.begin(), usual.beginning.end(), begins);
}

Usual usual_output(const std::optional<data::OutputQuantity>& quantity) {
  Usual usual{".output", "output", {"y"}, {"output"}};
  usual.beginning.push_back(name_of(quantity.value_or(data::OutputQuantity::velocity)));
  return usual;
}

using Kind = SignalSense::Kind;

Kind kind_of(data::OutputQuantity quantity) {
  switch (quantity) {
    case data::OutputQuantity::position:
      return Kind::position;
    case data::OutputQuantity::acceleration:
      return Kind::acceleration;
    case data::OutputQuantity::velocity:
      break;
  }
  return Kind::velocity;
}

class ColumnFinder {
 public:
  ColumnFinder(const Table& table, const ColumnMapping& mapping) : table_(table), mapping_(mapping) {}

  expected<FoundColumns, Error> find() {
    for (std::size_t i = 0; i < table_.names.size(); ++i) {
      bases_.push_back(named_unit(table_, i).base);
      senses_.push_back(sense_of_column(table_, i));
    }
    const Usual input{".input", "input", {"u"}, {"input", "torque"}};
    const Usual output = usual_output(mapping_.output_quantity);
    const Usual excitation{".excitation", "excitation", {"ru"}, {"excitation"}};
    const Usual reference{".reference", "reference", {"r"}, {"reference"}};
    const Usual position{".position", "position", {}, {"position"}};
    const bool no_time = mapping_.time && *mapping_.time == "none" && !index_of("none");
    // First what was named, so that no column is found for a second signal.
    auto t = no_time ? expected<Found, Error>(Found()) : named(".time", mapping_.time);
    auto u = named(input.option, mapping_.input);
    auto y = named(output.option, mapping_.output);
    auto ru = named(excitation.option, mapping_.excitation);
    auto r = named(reference.option, mapping_.reference);
    auto x = named(position.option, mapping_.position);
    auto z = named(".second_output", mapping_.second_output);
    for (const auto* result : {&t, &u, &y, &ru, &r, &x, &z})
      if (!*result) return unexpected<Error>(result->error());
    if (!no_time && !*t) t = find_time();
    if (t && !*u) u = needed(input, [this] { return sensed_input(); });
    if (t && u && !*y && z && *z && candidates(output).empty() && is_usual(output, bases_[**z]))
      return error(
          fmt::format("{} is the only column that is called like an output, and .second_output too; "
                      "name another one with .output",
                      in_quotes(table_.names[**z])));
    if (t && u && !*y) y = needed(output, [this] { return sensed_output(); });
    if (t && u && y && !*ru) ru = candidate(excitation);
    for (const auto* result : {&t, &u, &y, &ru})
      if (!*result) return unexpected<Error>(result->error());
    if (!*r) r = only_candidate(reference);
    if (!*x) x = only_candidate(position);
    FoundColumns found{*t, {}, **u, **y, *ru, *r, *x, *z};
    if (!no_time && !mapping_.time && times_.size() > 1) assign_times(found);
    return checked(found);
  }

 private:
  using Found = std::optional<std::size_t>;

  [[nodiscard]] Found index_of(std::string_view name) const {
    const auto found = std::find(table_.names.begin(), table_.names.end(), name);
    if (found == table_.names.end()) return {};
    return static_cast<std::size_t>(found - table_.names.begin());
  }

  [[nodiscard]] unexpected<Error> error(std::string_view message) const {
    return fail(table_.source, fmt::format("{}; columns: {}", message, listed(table_.names)));
  }

  expected<Found, Error> named(std::string_view option, const std::optional<std::string>& name) {
    if (!name) return Found();
    if (const Found found = index_of(*name)) {
      taken_.push_back(*found);
      return found;
    }
    for (const auto& variable : table_.unusable)
      if (variable.name == *name)
        return fail(table_.source,
                    fmt::format("variable {} ({}) {}", in_quotes(*name), option, variable.reason));
    for (const auto& scalar : table_.scalars)
      if (scalar.name == *name)
        return fail(table_.source,
                    fmt::format("variable {} ({}) is a single number; one real numeric vector is required",
                                in_quotes(*name), option));
    const std::string similar = nearest(*name, table_.names);
    return error(fmt::format("there is no column {} ({}){}", in_quotes(*name), option,
                             similar.empty() ? "" : fmt::format("; did you mean {}?", in_quotes(similar))));
  }

  /// Whether a column that is called like the input or the output cannot be it: by its unit, as a limit or an
  /// error, or, of an output, as a set-point.
  [[nodiscard]] bool is_foreign(const Usual& usual, std::size_t column) const {
    const bool input = usual.option == ".input", output = usual.option == ".output";
    if (!input && !output) return false;
    const SignalSense& sense = senses_[column];
    if (sense.aside) return true;
    const auto unit = known_unit(named_unit(table_, column).unit);
    if (!unit) return output && sense.commanded && !sense.actual;
    if (input) return quantity_of(unit->dimension).has_value() || unit->dimension == Dimension::time;
    return !quantity_of(unit->dimension) || (sense.commanded && !sense.actual);
  }

  [[nodiscard]] std::vector<std::size_t> candidates(const Usual& usual) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < table_.names.size(); ++i)
      if (std::find(taken_.begin(), taken_.end(), i) == taken_.end() && is_usual(usual, bases_[i]) &&
          (is_exact(usual, i) || !is_foreign(usual, i)))
        found.push_back(i);
    return found;
  }

  expected<Found, Error> candidate(const Usual& usual) {
    const auto found = candidates(usual);
    if (found.empty()) return Found();
    const auto best = preferred(found, usual.option == ".output");
    if (best.size() > 1) return several(found, usual.signal, usual.option);
    taken_.push_back(best.front());
    return Found(best.front());
  }

  [[nodiscard]] std::vector<std::size_t> of_kind(Kind kind) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < senses_.size(); ++i)
      if (senses_[i].kind == kind && std::find(taken_.begin(), taken_.end(), i) == taken_.end())
        found.push_back(i);
    return found;
  }

  [[nodiscard]] unexpected<Error> several(const std::vector<std::size_t>& found, std::string_view signal,
                                          std::string_view option) const {
    std::vector<std::string> names;
    for (const std::size_t i : found) names.push_back(table_.names[i]);
    return error(fmt::format("{} columns may be the {} ({}); choose one with {}", found.size(), signal,
                             listed(names), option));
  }

  /// The only one that is measured, where others are said to be commanded.
  [[nodiscard]] std::vector<std::size_t> preferred(std::vector<std::size_t> found, bool may_be_unsaid) const {
    if (found.size() < 2) return found;
    std::vector<std::size_t> measured;
    for (const std::size_t i : found)
      if (senses_[i].actual || (may_be_unsaid && !senses_[i].commanded)) measured.push_back(i);
    return measured.size() == 1 ? measured : found;
  }

  /// A torque or force, else a current. What is only said to be commanded may be the only one that is
  /// recorded; of several the one that is said to be measured.
  expected<Found, Error> sensed_input() {
    for (const Kind kind : {Kind::torque, Kind::current}) {
      const auto found = preferred(of_kind(kind), false);
      if (found.empty()) continue;
      if (found.size() > 1) return several(found, "input", ".input");
      taken_.push_back(found.front());
      return Found(found.front());
    }
    return Found();
  }

  /// A velocity, else a position, else an acceleration, when none of them was asked for.
  expected<Found, Error> sensed_output() {
    std::vector<Kind> kinds = {Kind::velocity, Kind::position, Kind::acceleration};
    if (mapping_.output_quantity) kinds = {kind_of(*mapping_.output_quantity)};
    for (const Kind kind : kinds) {
      auto found = of_kind(kind);
      std::erase_if(found, [&](std::size_t i) { return senses_[i].commanded && !senses_[i].actual; });
      found = preferred(std::move(found), true);
      if (found.empty()) continue;
      if (found.size() > 1) return several(found, "output", ".output");
      taken_.push_back(found.front());
      return Found(found.front());
    }
    return Found();
  }

  /// The time column nearest to the left of each signal.
  void assign_times(FoundColumns& found) const {
    const auto time_of = [&](std::size_t column) {
      std::size_t best = times_.front();
      for (const std::size_t t : times_)
        if (t < column && (t > best || best > column)) best = t;
      return best;
    };
    for (const auto& column : {Found(found.input), Found(found.output), found.excitation, found.reference,
                               found.position, found.second_output})
      if (column) found.times.push_back(time_of(*column));
    found.time = found.times.front();
  }

  /// A signal without which the work goes on: several candidates are as good as none.
  Found only_candidate(const Usual& usual) {
    const auto found = candidates(usual);
    if (found.size() != 1) return {};
    taken_.push_back(found.front());
    return found.front();
  }

  static bool is_like(const Usual& usual, Kind kind) {
    if (usual.option == ".input") return kind == Kind::torque || kind == Kind::current;
    return kind == Kind::velocity || kind == Kind::position || kind == Kind::acceleration;
  }

  /// Called by nothing but the symbol or the word.
  [[nodiscard]] bool is_exact(const Usual& usual, std::size_t column) const {
    const std::string base = lower(bases_[column]);
    return std::find(usual.whole.begin(), usual.whole.end(), base) != usual.whole.end() ||
           std::find(usual.beginning.begin(), usual.beginning.end(), base) != usual.beginning.end();
  }

  /// Other columns of the same kind that are measured as well, as far as their names tell.
  [[nodiscard]] std::vector<std::size_t> rivals(std::size_t column) const {
    const SignalSense& own = senses_[column];
    if (own.kind == Kind::none || own.actual) return {};
    auto others = of_kind(own.kind);
    std::erase_if(others, [&](std::size_t i) { return senses_[i].commanded && !senses_[i].actual; });
    return others;
  }

  template <class Sensed>
  expected<Found, Error> needed(const Usual& usual, Sensed sensed) {
    auto found = candidate(usual);
    if (found && *found && !is_exact(usual, **found))
      if (auto others = rivals(**found); !others.empty()) {
        others.insert(others.begin(), **found);
        return several(others, usual.signal, usual.option);
      }
    if (found && !*found) found = sensed();
    if (!found || *found) return found;
    for (const auto& variable : table_.unusable)
      if (is_usual(usual, take_apart(variable.name).base))
        return error(fmt::format("variable {}, which may be the {}, {}; choose another with {}",
                                 in_quotes(variable.name), usual.signal, variable.reason, usual.option));
    for (const auto& variable : table_.unusable)
      if (is_like(usual,
                  sense_of(take_apart(variable.name).base, known_unit(take_apart(variable.name).unit)).kind))
        return error(fmt::format("column {}, which may be the {}, {}; choose another with {}",
                                 in_quotes(variable.name), usual.signal, variable.reason, usual.option));
    return error(fmt::format("no column is called like an {} ({}); name it with {}", usual.signal,
                             names_of(usual), usual.option));
  }

  /// The column that is called like a time; of several the one that is called `t` or `time`, unless each
  /// signal may have one of its own. Else the sample's number. Without a header the first column, where it
  /// rises evenly.
  expected<Found, Error> find_time() {
    times_ = of_kind(Kind::time);
    if (times_.empty()) times_ = of_kind(Kind::sample_number);
    if (times_.empty() && !table_.names.empty() && table_.names.front() == "c1" &&
        rises_evenly(table_.columns.front()))
      times_ = {0};
    if (times_.empty()) return Found();
    for (const std::size_t i : times_) taken_.push_back(i);
    if (times_.size() == 1 || each_has_its_own()) return Found(times_.front());
    const Usual time{".time", "time", {"t", "time"}, {}};
    std::vector<std::size_t> usual;
    for (const std::size_t i : times_)
      if (is_usual(time, bases_[i])) usual.push_back(i);
    if (usual.size() != 1) return several(times_, "time", ".time");
    times_ = usual;
    return Found(usual.front());
  }

  /// Time columns of per-channel recordings stand between the signals.
  [[nodiscard]] bool each_has_its_own() const {
    for (std::size_t i = 1; i < times_.size(); ++i)
      if (times_[i] == times_[i - 1] + 1) return false;
    return times_.back() + 1 < table_.names.size();
  }

  static bool rises_evenly(const std::vector<double>& x) {
    if (x.size() < 3) return false;
    const double step = (x.back() - x.front()) / static_cast<double>(x.size() - 1);
    for (std::size_t i = 1; i < x.size(); ++i)
      if (!(std::abs(x[i] - x[i - 1] - step) < 0.5 * step)) return false;
    return step > 0.0;
  }

  [[nodiscard]] expected<FoundColumns, Error> checked(const FoundColumns& found) const {
    const auto same = [&](std::string_view a, std::string_view b, std::size_t column) {
      return error(fmt::format("{} and {} are the same column {}", a, b, in_quotes(table_.names[column])));
    };
    if (found.input == found.output) return same(".input", ".output", found.input);
    if (found.time && *found.time == found.input) return same(".time", ".input", found.input);
    if (found.time && *found.time == found.output) return same(".time", ".output", found.output);
    if (const auto& second = found.second_output) {
      const std::pair<std::string_view, std::optional<std::size_t>> others[] = {
          {".output", found.output},
          {".input", found.input},
          {".time", found.time},
          {".excitation", found.excitation},
          {".reference", found.reference}};
      for (const auto& [option, column] : others)
        if (column == second) return same(option, ".second_output", *second);
    }
    std::vector<std::size_t> used = {found.output, found.input};
    for (const auto& column :
         {found.time, found.excitation, found.reference, found.position, found.second_output})
      if (column) used.push_back(*column);
    const std::size_t length = table_.columns[found.output].size();
    for (const std::size_t i : used)
      if (table_.columns[i].size() != length)
        return fail(table_.source,
                    fmt::format("{} has {} samples and {} has {}; all signals must have equally many",
                                in_quotes(table_.names[found.output]), length, in_quotes(table_.names[i]),
                                table_.columns[i].size()));
    return found;
  }

  const Table& table_;
  const ColumnMapping& mapping_;
  std::vector<std::size_t> taken_;
  std::vector<std::size_t> times_;
  std::vector<std::string> bases_;   // [column]
  std::vector<SignalSense> senses_;  // [column]
};

}  // namespace

namespace {
constexpr std::string_view kAngles[] = {"theta", "phi", "angle", "winkel", "encoder"};
}  // namespace

NamedUnit named_unit(const Table& table, std::size_t column) {
  NamedUnit named = take_apart(table.names[column]);
  if (column < table.units.size() && !table.units[column].empty()) named.unit = table.units[column];
  // "omega_m" and "theta_m" are those of the motor, "torque_s" is that of a shaft: in no unit that is told.
  const bool of_suffix = table.names[column].ends_with("_" + named.unit) && named.unit.size() == 1;
  if (!of_suffix || (named.unit != "m" && named.unit != "s")) return named;
  const Kind kind = sense_of(named.base, std::nullopt).kind;
  const std::string base = lower(named.base);
  const bool turns = std::any_of(std::begin(kAngles), std::end(kAngles),
                                 [&](std::string_view word) { return base.find(word) != base.npos; });
  const bool fits = named.unit == "s"
                        ? kind == Kind::none || kind == Kind::time || kind == Kind::sample_number
                        : kind == Kind::position && !turns;
  if (!fits) return {table.names[column], {}};
  return named;
}

SignalSense sense_of_column(const Table& table, std::size_t column) {
  const NamedUnit named = named_unit(table, column);
  return sense_of(named.base, known_unit(named.unit));
}

data::OutputQuantity output_quantity(const Table& table, const ColumnMapping& mapping, std::size_t output) {
  if (mapping.output_quantity) return *mapping.output_quantity;
  switch (sense_of_column(table, output).kind) {
    case Kind::position:
      return data::OutputQuantity::position;
    case Kind::acceleration:
      return data::OutputQuantity::acceleration;
    default:
      return data::OutputQuantity::velocity;
  }
}

expected<FoundColumns, Error> find_columns(const Table& table, const ColumnMapping& mapping) {
  return ColumnFinder(table, mapping).find();
}

}  // namespace resonid::io
