// SPDX-License-Identifier: MIT
#include "io/columns.hpp"

#include <fmt/core.h>

#include <algorithm>
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

bool is_usual(const Usual& usual, std::string_view column) {
  const std::string base = lower(take_apart(column).base);
  const auto begins = [&](std::string_view start) { return base.compare(0, start.size(), start) == 0; };
  return std::find(usual.whole.begin(), usual.whole.end(), base) != usual.whole.end() ||
         std::any_of(usual.beginning.begin(), usual.beginning.end(), begins);
}

Usual usual_output(data::OutputQuantity quantity) {
  Usual usual{".output", "output", {"y"}, {"output"}};
  usual.beginning.push_back(name_of(quantity));
  return usual;
}

class ColumnFinder {
 public:
  ColumnFinder(const Table& table, const ColumnMapping& mapping) : table_(table), mapping_(mapping) {}

  expected<FoundColumns, Error> find() {
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
    if (t && !*u) u = needed(input);
    if (t && u && !*y && z && *z && candidates(output).empty() && is_usual(output, table_.names[**z]))
      return error(
          fmt::format("{} is the only column that is called like an output, and .second_output too; "
                      "name another one with .output",
                      in_quotes(table_.names[**z])));
    if (t && u && !*y) y = needed(output);
    if (t && u && y && !*ru) ru = candidate(excitation);
    for (const auto* result : {&t, &u, &y, &ru})
      if (!*result) return unexpected<Error>(result->error());
    if (!*r) r = only_candidate(reference);
    if (!*x) x = only_candidate(position);
    return checked(FoundColumns{*t, **u, **y, *ru, *r, *x, *z});
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

  [[nodiscard]] std::vector<std::size_t> candidates(const Usual& usual) const {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < table_.names.size(); ++i)
      if (std::find(taken_.begin(), taken_.end(), i) == taken_.end() && is_usual(usual, table_.names[i]))
        found.push_back(i);
    return found;
  }

  expected<Found, Error> candidate(const Usual& usual) {
    const auto found = candidates(usual);
    if (found.empty()) return Found();
    if (found.size() > 1) {
      std::vector<std::string> names;
      for (const std::size_t i : found) names.push_back(table_.names[i]);
      return error(fmt::format("{} columns may be the {} ({}); choose one with {}", found.size(),
                               usual.signal, listed(names), usual.option));
    }
    taken_.push_back(found.front());
    return Found(found.front());
  }

  /// A signal without which the work goes on: several candidates are as good as none.
  Found only_candidate(const Usual& usual) {
    const auto found = candidates(usual);
    if (found.size() != 1) return {};
    taken_.push_back(found.front());
    return found.front();
  }

  expected<Found, Error> needed(const Usual& usual) {
    auto found = candidate(usual);
    if (!found || *found) return found;
    for (const auto& variable : table_.unusable)
      if (is_usual(usual, variable.name))
        return error(fmt::format("variable {}, which may be the {}, {}; choose another with {}",
                                 in_quotes(variable.name), usual.signal, variable.reason, usual.option));
    return error(fmt::format("no column is called like an {} ({}); name it with {}", usual.signal,
                             names_of(usual), usual.option));
  }

  expected<Found, Error> find_time() {
    const Usual time{".time", "time", {"t", "time"}, {}};
    std::vector<std::size_t> seconds;
    std::vector<std::size_t> others;
    for (const std::size_t i : candidates(time)) {
      const NamedUnit name = take_apart(table_.names[i]);
      (name.unit.empty() || name.unit == "s" ? seconds : others).push_back(i);
    }
    if (seconds.size() == 1) {
      taken_.push_back(seconds.front());
      return Found(seconds.front());
    }
    if (seconds.size() > 1) return candidate(time);
    if (!others.empty() && mapping_.sample_rate_hz == 0.0)
      return error(fmt::format(
          "the time must be in seconds, column {} is in {}; give .sample_rate_hz instead",
          in_quotes(table_.names[others.front()]), take_apart(table_.names[others.front()]).unit));
    return Found();
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
};

}  // namespace

expected<FoundColumns, Error> find_columns(const Table& table, const ColumnMapping& mapping) {
  return ColumnFinder(table, mapping).find();
}

}  // namespace resonid::io
