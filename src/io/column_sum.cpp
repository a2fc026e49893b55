// SPDX-License-Identifier: MIT
#include "io/column_sum.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>

#include "io/text.hpp"
#include "io/units.hpp"

namespace resonid::io {
namespace {

struct Term {
  double factor = 1.0;
  std::size_t column = 0;
};

class SumParser {
 public:
  SumParser(std::string_view text, const std::vector<std::string>& names) : rest_(text), names_(names) {}

  /// Nothing where the text is no sum; rest() then begins with what does not fit.
  std::optional<std::vector<Term>> parse() {
    std::vector<Term> terms;
    do {
      double sign = 1.0;
      if (took('-'))
        sign = -1.0;
      else if (!took('+') && !terms.empty())
        return std::nullopt;
      auto one = term();
      if (!one) return std::nullopt;
      one->factor *= sign;
      terms.push_back(*one);
      skip();
    } while (!rest_.empty());
    return terms;
  }
  [[nodiscard]] std::string_view rest() const { return rest_; }

 private:
  void skip() { rest_.remove_prefix(std::min(rest_.find_first_not_of(' '), rest_.size())); }

  bool took(char c) {
    skip();
    if (rest_.empty() || rest_.front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }

  std::optional<Term> term() {
    skip();
    if (const auto found = column()) {
      if (!took('*')) return Term{1.0, *found};
      const auto factor = number();
      return factor ? std::optional(Term{*factor, *found}) : std::nullopt;
    }
    const auto factor = number();
    if (!factor || !took('*')) return std::nullopt;
    skip();
    const auto found = column();
    return found ? std::optional(Term{*factor, *found}) : std::nullopt;
  }

  std::optional<double> number() {
    skip();
    double value = 0.0;
    const auto read = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (read.ec != std::errc() || !std::isfinite(value)) return std::nullopt;
    rest_.remove_prefix(static_cast<std::size_t>(read.ptr - rest_.data()));
    return value;
  }

  std::optional<std::size_t> column() {
    std::optional<std::size_t> longest;
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const std::string_view name = names_[i];
      if (name.empty() || rest_.substr(0, name.size()) != name) continue;
      constexpr std::string_view kEnds = " +-*";
      const bool ends = rest_.size() == name.size() || kEnds.find(rest_[name.size()]) != kEnds.npos;
      if (ends && (!longest || names_[*longest].size() < name.size())) longest = i;
    }
    if (longest) rest_.remove_prefix(names_[*longest].size());
    return longest;
  }

  std::string_view rest_;
  const std::vector<std::string>& names_;
};

/// "(a_V - b_V) [V]"
std::string name_of_sum(const std::string& text, const std::vector<Term>& terms, const Table& table) {
  const auto unit_of = [&](const Term& term) { return take_apart(table.names[term.column]).unit; };
  const std::string unit = unit_of(terms.front());
  const bool known = !unit.empty() && std::all_of(terms.begin(), terms.end(), [&](const Term& t) {
    return std::abs(t.factor) == 1.0 && unit_of(t) == unit;
  });
  return known ? fmt::format("({}) [{}]", text, unit) : fmt::format("({})", text);
}

}  // namespace

expected<std::optional<SummedTable>, Error> add_sums(const Table& table, const ColumnMapping& mapping) {
  std::optional<SummedTable> result;
  const auto resolve = [&](const char* option,
                           std::optional<std::string> ColumnMapping::*field) -> expected<void, Error> {
    const auto& text = mapping.*field;
    if (!text || text->find_first_of("+-*") == std::string::npos) return {};
    const auto is_name = [&](const auto& variable) { return variable.name == *text; };
    if (std::find(table.names.begin(), table.names.end(), *text) != table.names.end() ||
        std::any_of(table.scalars.begin(), table.scalars.end(), is_name) ||
        std::any_of(table.unusable.begin(), table.unusable.end(), is_name))
      return {};
    SumParser parser(*text, table.names);
    const auto terms = parser.parse();
    if (!terms) {
      if (text->find('*') == std::string::npos) return {};  // a name that is not there; said as of any other
      return fail(
          table.source,
          fmt::format("{} {} is no sum of columns: found {}, required a column's name or "
                      "FACTOR*NAME; columns: {}",
                      option, in_quotes(*text), parser.rest().empty() ? "the end" : in_quotes(parser.rest()),
                      listed(table.names)));
    }
    std::vector<double> sum(table.columns[terms->front().column].size(), 0.0);
    for (const Term& term : *terms) {
      const auto& column = table.columns[term.column];
      if (column.size() != sum.size())
        return fail(table.source,
                    fmt::format("{} adds columns of {} and {} samples; all must have equally many", option,
                                sum.size(), column.size()));
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += term.factor * column[k];
    }
    if (!result) result = SummedTable{table, mapping};
    const std::string name = name_of_sum(*text, *terms, table);
    result->mapping.*field = name;
    auto& names = result->table.names;
    if (std::find(names.begin(), names.end(), name) != names.end()) return {};
    names.push_back(name);
    result->table.units.resize(result->table.columns.size());
    result->table.units.emplace_back();
    result->table.columns.push_back(std::move(sum));
    return {};
  };
  using Field = std::optional<std::string> ColumnMapping::*;
  constexpr std::pair<const char*, Field> kSignals[] = {{".input", &ColumnMapping::input},
                                                        {".output", &ColumnMapping::output},
                                                        {".excitation", &ColumnMapping::excitation},
                                                        {".reference", &ColumnMapping::reference},
                                                        {".second_output", &ColumnMapping::second_output}};
  for (const auto& signal : kSignals)
    if (auto done = resolve(signal.first, signal.second); !done) return unexpected<Error>(done.error());
  return result;
}

}  // namespace resonid::io
