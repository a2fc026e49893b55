// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/io/detail/own_units.hpp>
#include <string_view>
#include <vector>

#include "io/signal_names.hpp"
#include "io/signal_units.hpp"
#include "io/text.hpp"
#include "io/units.hpp"

namespace resonid::io {
namespace {

/// The unit in "'n': rpm converted to rad/s (x 0.10472)", whatever explains it; empty: no such note.
std::string noted_unit(const ReadSignal& signal) {
  const std::string start = in_quotes(signal.column) + ": ";
  for (const std::string_view note : signal.notes) {
    if (!note.starts_with(start) || note.find(" converted to ") == note.npos) continue;
    const auto rest = note.substr(start.size());
    return std::string(rest.substr(0, std::min({rest.find(", "), rest.find(" times the "),
                                                rest.find(" of the rated"), rest.find(" converted to ")})));
  }
  return {};
}

/// The unit of the column's numbers: by the reader's note (a row of units too), by its name, by the user
/// where nothing is scaled.
std::string told_unit(const ReadSignal& signal, const std::optional<std::string>& given, bool scaled) {
  if (auto noted = noted_unit(signal); !noted.empty()) return noted;
  const auto named = take_apart(signal.column);
  const auto known = known_unit(named.unit);
  // "omega_m" is that of the motor, not one in metres.
  const bool of_suffix = signal.column.ends_with("_" + named.unit) && known &&
                         (named.unit == "m" || known->dimension == Dimension::time);
  if (!named.unit.empty() && !of_suffix) return named.unit;
  return scaled ? std::string() : given.value_or("");
}

/// By the reader's own conversion, so that both say the same.
OwnUnit own_unit(const ReadSignal& signal, const ColumnMapping& mapping,
                 const std::optional<std::string>& given, double scale, const std::string& si) {
  const bool scaled = std::abs(scale) != 1.0;
  const std::string unit = told_unit(signal, given, scaled);
  std::vector<std::string> notes;
  const auto conversion =
      UnitConverter(mapping, signal.motion, notes).convert({signal.column, unit, given, scale, si});
  if (!unit.empty() || scaled) return {unit, conversion.factor};
  return {conversion.factor == 1.0 || conversion.factor == -1.0 ? si : std::string(), conversion.factor};
}

}  // namespace

OwnUnit own_input_unit(const ReadSignal& signal, const ColumnMapping& mapping) {
  const auto named = take_apart(signal.column);
  const bool current = sense_of(named.base, known_unit(named.unit)).kind == SignalSense::Kind::current &&
                       std::abs(mapping.input_scale) == 1.0;
  return own_unit(signal, mapping, mapping.input_unit, mapping.input_scale,
                  current ? std::string(base_unit(Dimension::current)) : signal.unit);
}

OwnUnit own_velocity_unit(const ReadSignal& signal, const ColumnMapping& mapping,
                          data::OutputQuantity quantity) {
  if (mapping.differentiate) quantity = data::OutputQuantity::position;
  auto own = own_unit(
      signal, mapping, mapping.output_unit, mapping.output_scale,
      quantity == data::OutputQuantity::velocity ? signal.unit : output_si_unit(signal.motion, quantity));
  const bool told_of_velocity = mapping.differentiate && mapping.output_unit == own.unit;
  if (own.unit.empty() || told_of_velocity) return own;
  if (quantity == data::OutputQuantity::position) own.unit += "/s";
  if (quantity == data::OutputQuantity::acceleration)
    own.unit = own.unit.ends_with("/s2") ? own.unit.substr(0, own.unit.size() - 1) : own.unit + " s";
  return own;
}

}  // namespace resonid::io
