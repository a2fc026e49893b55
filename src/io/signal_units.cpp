// SPDX-License-Identifier: MIT
#include "io/signal_units.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "io/text.hpp"
#include "io/units.hpp"

namespace resonid::io {

void UnitConverter::note_converted(const SignalUnit& signal, const std::string& from, double factor,
                                   const std::string& to) {
  notes_.push_back(
      fmt::format("{}: {} converted to {} (x {:.6g})", in_quotes(signal.column), from, to, factor));
}

Conversion UnitConverter::to_torque(const SignalUnit& signal, double factor, const char* what) {
  const std::string si = input_si_unit(motion_);
  const std::string unit = signal.given.value_or(signal.unit);
  note_converted(signal, fmt::format("{} {}", unit.empty() ? signal.si : unit, what), factor, si);
  return {factor * signal.scale, si};
}

Conversion UnitConverter::convert(const SignalUnit& signal) {
  const std::string unit = signal.given.value_or(signal.unit);
  const bool scaled = std::abs(signal.scale) != 1.0;
  // A scale gives SI, unless the user says what.
  if (scaled && !signal.given) return {signal.scale, signal.si};
  const bool assumed = unit.empty() && signal.quantity.empty();
  if (unit.empty()) {
    notes_.push_back(assumed ? fmt::format("no unit in {}: {} assumed", in_quotes(signal.column), signal.si)
                             : fmt::format("{} taken for a {} in {}", in_quotes(signal.column),
                                           signal.quantity, signal.si));
    if (signal.si != base_unit(Dimension::current)) return {signal.scale, signal.si, assumed};
  }
  const auto known = known_unit(unit.empty() ? signal.si : unit);
  if (!known) return {signal.scale, unit};
  const double factor = known->factor;
  switch (known->dimension) {
    case Dimension::ratio:
      if (mapping_.rated_torque)
        return to_torque(signal, factor * *mapping_.rated_torque, "of the rated torque");
      notes_.push_back(fmt::format("{} is in {} of something rated: give .rated_torque for {}",
                                   in_quotes(signal.column), unit, input_si_unit(motion_)));
      return {signal.scale, unit};
    case Dimension::current:
      if (mapping_.torque_constant)
        return to_torque(signal, factor * *mapping_.torque_constant, "times the torque constant");
      notes_.push_back(fmt::format("{} is a current: give .torque_constant for {}", in_quotes(signal.column),
                                   input_si_unit(motion_)));
      break;
    case Dimension::counts:
    case Dimension::count_rate:
      if (mapping_.counts_per_rev) {
        const double turn = 2.0 * std::numbers::pi / *mapping_.counts_per_rev;
        const std::string to = known->dimension == Dimension::counts ? "rad" : "rad/s";
        note_converted(signal, fmt::format("{}, {:g} per turn,", unit, *mapping_.counts_per_rev),
                       turn * factor, to);
        return {signal.scale * turn * factor, to};
      }
      notes_.push_back(
          fmt::format("{} is in {}: give .counts_per_rev for rad", in_quotes(signal.column), unit));
      return {signal.scale, unit};
    default:
      break;
  }
  const std::string base(base_unit(known->dimension));
  if (factor != 1.0) note_converted(signal, unit, factor, base);
  return {signal.scale * factor, base, assumed};
}

}  // namespace resonid::io
