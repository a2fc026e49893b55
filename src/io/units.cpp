// SPDX-License-Identifier: MIT
#include "io/units.hpp"

#include <array>
#include <cstddef>
#include <numbers>
#include <utility>

#include "io/text.hpp"

namespace resonid::io {
namespace {

struct Suffix {
  std::string_view text;
  std::string_view unit;
  bool any_case;  // a single letter or a prefix means something else in the other case
};

// The longest match counts, so that "_rad_s" is not taken for "_s".
constexpr std::array<Suffix, 46> kSuffixes = {{
    {"_rad_s2", "rad/s2", true},
    {"_deg_s2", "deg/s2", true},
    {"_rev_s2", "rev/s2", true},
    {"_mm_s2", "mm/s2", true},
    {"_m_s2", "m/s2", true},
    {"_counts_s", "counts/s", true},
    {"_mrad_s", "mrad/s", true},
    {"_rad_s", "rad/s", true},
    {"_deg_s", "deg/s", true},
    {"_rev_s", "rev/s", true},
    {"_turns_s", "rev/s", true},
    {"_rads", "rad/s", false},
    {"_mm_min", "mm/min", true},
    {"_m_min", "m/min", true},
    {"_1_min", "1/min", true},
    {"_u_min", "1/min", true},
    {"_mm_s", "mm/s", true},
    {"_um_s", "um/s", true},
    {"_m_s", "m/s", true},
    {"_mrad", "mrad", false},
    {"_rad", "rad", true},
    {"_deg", "deg", true},
    {"_turns", "rev", true},
    {"_rev", "rev", true},
    {"_counts", "counts", true},
    {"_cnt", "counts", true},
    {"_rpm", "rpm", true},
    {"_percent", "%", true},
    {"_permille", "permille", true},
    {"_mNm", "mNm", false},
    {"_Ncm", "Ncm", true},
    {"_Nm", "Nm", true},
    {"_kN", "kN", false},
    {"_N", "N", false},
    {"_mA", "mA", false},
    {"_A", "A", false},
    {"_mV", "mV", false},
    {"_V", "V", false},
    {"_mm", "mm", true},
    {"_um", "um", true},
    {"_m", "m", false},
    {"_ms", "ms", true},
    {"_us", "us", true},
    {"_ns", "ns", true},
    {"_s", "s", true},
    {"_Hz", "Hz", true},
}};

std::string trimmed(std::string_view text) {
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  return std::string(text);
}

struct Spelling {
  std::string_view text;
  Unit unit;
};

constexpr double kPi = std::numbers::pi;
constexpr double kStandardGravity = 9.80665;     // m/s2
constexpr double kPoundForce = 4.4482216152605;  // N
constexpr double kInch = 0.0254;                 // m

// In lower case and without blanks, dots, asterisks, carets and brackets (bare()).
constexpr std::array kSpellings = {
    Spelling{"s", {Dimension::time, 1.0}},
    Spelling{"sec", {Dimension::time, 1.0}},
    Spelling{"sek", {Dimension::time, 1.0}},
    Spelling{"second", {Dimension::time, 1.0}},
    Spelling{"seconds", {Dimension::time, 1.0}},
    Spelling{"ms", {Dimension::time, 1e-3}},
    Spelling{"msec", {Dimension::time, 1e-3}},
    Spelling{"milliseconds", {Dimension::time, 1e-3}},
    Spelling{"us", {Dimension::time, 1e-6}},
    Spelling{"usec", {Dimension::time, 1e-6}},
    Spelling{"microseconds", {Dimension::time, 1e-6}},
    Spelling{"ns", {Dimension::time, 1e-9}},
    Spelling{"100ns", {Dimension::time, 1e-7}},
    Spelling{"min", {Dimension::time, 60.0}},
    Spelling{"rad", {Dimension::angle, 1.0}},
    Spelling{"mrad", {Dimension::angle, 1e-3}},
    Spelling{"deg", {Dimension::angle, kPi / 180.0}},
    Spelling{"degree", {Dimension::angle, kPi / 180.0}},
    Spelling{"degrees", {Dimension::angle, kPi / 180.0}},
    Spelling{"grad", {Dimension::angle, kPi / 180.0}},  // German
    Spelling{"mdeg", {Dimension::angle, kPi / 180e3}},
    Spelling{"rev", {Dimension::angle, 2.0 * kPi}},
    Spelling{"revs", {Dimension::angle, 2.0 * kPi}},
    Spelling{"turn", {Dimension::angle, 2.0 * kPi}},
    Spelling{"turns", {Dimension::angle, 2.0 * kPi}},
    Spelling{"umdr", {Dimension::angle, 2.0 * kPi}},
    Spelling{"rad/s", {Dimension::angular_velocity, 1.0}},
    Spelling{"rads-1", {Dimension::angular_velocity, 1.0}},
    Spelling{"rad/sec", {Dimension::angular_velocity, 1.0}},
    Spelling{"mrad/s", {Dimension::angular_velocity, 1e-3}},
    Spelling{"deg/s", {Dimension::angular_velocity, kPi / 180.0}},
    Spelling{"deg/sec", {Dimension::angular_velocity, kPi / 180.0}},
    Spelling{"grad/s", {Dimension::angular_velocity, kPi / 180.0}},
    Spelling{"dps", {Dimension::angular_velocity, kPi / 180.0}},
    Spelling{"rev/s", {Dimension::angular_velocity, 2.0 * kPi}},
    Spelling{"turn/s", {Dimension::angular_velocity, 2.0 * kPi}},
    Spelling{"turns/s", {Dimension::angular_velocity, 2.0 * kPi}},
    Spelling{"u/s", {Dimension::angular_velocity, 2.0 * kPi}},
    Spelling{"rps", {Dimension::angular_velocity, 2.0 * kPi}},
    Spelling{"rpm", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"1/min", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"/min", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"min-1", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"u/min", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"r/min", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"rev/min", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"upm", {Dimension::angular_velocity, kPi / 30.0}},
    Spelling{"krpm", {Dimension::angular_velocity, kPi / 0.030}},
    Spelling{"rad/s2", {Dimension::angular_acceleration, 1.0}},
    Spelling{"deg/s2", {Dimension::angular_acceleration, kPi / 180.0}},
    Spelling{"rev/s2", {Dimension::angular_acceleration, 2.0 * kPi}},
    Spelling{"turns/s2", {Dimension::angular_acceleration, 2.0 * kPi}},
    Spelling{"rpm/s", {Dimension::angular_acceleration, kPi / 30.0}},
    Spelling{"m", {Dimension::length, 1.0}},
    Spelling{"cm", {Dimension::length, 1e-2}},
    Spelling{"mm", {Dimension::length, 1e-3}},
    Spelling{"um", {Dimension::length, 1e-6}},
    Spelling{"in", {Dimension::length, kInch}},
    Spelling{"inch", {Dimension::length, kInch}},
    Spelling{"m/s", {Dimension::velocity, 1.0}},
    Spelling{"cm/s", {Dimension::velocity, 1e-2}},
    Spelling{"mm/s", {Dimension::velocity, 1e-3}},
    Spelling{"mm/sec", {Dimension::velocity, 1e-3}},
    Spelling{"um/s", {Dimension::velocity, 1e-6}},
    Spelling{"m/min", {Dimension::velocity, 1.0 / 60.0}},
    Spelling{"mm/min", {Dimension::velocity, 1e-3 / 60.0}},
    Spelling{"in/s", {Dimension::velocity, kInch}},
    Spelling{"m/s2", {Dimension::acceleration, 1.0}},
    Spelling{"mm/s2", {Dimension::acceleration, 1e-3}},
    Spelling{"mm/sec2", {Dimension::acceleration, 1e-3}},
    Spelling{"g", {Dimension::acceleration, kStandardGravity}},
    Spelling{"mg", {Dimension::acceleration, 1e-3 * kStandardGravity}},
    Spelling{"nm", {Dimension::torque, 1.0}},
    Spelling{"mnm", {Dimension::torque, 1e-3}},
    Spelling{"knm", {Dimension::torque, 1e3}},
    Spelling{"unm", {Dimension::torque, 1e-6}},
    Spelling{"ncm", {Dimension::torque, 1e-2}},
    Spelling{"lb-in", {Dimension::torque, kPoundForce* kInch}},
    Spelling{"lbin", {Dimension::torque, kPoundForce* kInch}},
    Spelling{"in-lb", {Dimension::torque, kPoundForce* kInch}},
    Spelling{"lbfin", {Dimension::torque, kPoundForce* kInch}},
    Spelling{"lb-ft", {Dimension::torque, 12.0 * kPoundForce* kInch}},
    Spelling{"lbft", {Dimension::torque, 12.0 * kPoundForce* kInch}},
    Spelling{"ft-lb", {Dimension::torque, 12.0 * kPoundForce* kInch}},
    Spelling{"lbfft", {Dimension::torque, 12.0 * kPoundForce* kInch}},
    Spelling{"oz-in", {Dimension::torque, kPoundForce* kInch / 16.0}},
    Spelling{"ozin", {Dimension::torque, kPoundForce* kInch / 16.0}},
    Spelling{"n", {Dimension::force, 1.0}},
    Spelling{"kn", {Dimension::force, 1e3}},
    Spelling{"mn", {Dimension::force, 1e-3}},
    Spelling{"lbf", {Dimension::force, kPoundForce}},
    Spelling{"a", {Dimension::current, 1.0}},
    Spelling{"amp", {Dimension::current, 1.0}},
    Spelling{"amps", {Dimension::current, 1.0}},
    Spelling{"ampere", {Dimension::current, 1.0}},
    Spelling{"arms", {Dimension::current, 1.0}},
    Spelling{"ma", {Dimension::current, 1e-3}},
    Spelling{"v", {Dimension::voltage, 1.0}},
    Spelling{"mv", {Dimension::voltage, 1e-3}},
    Spelling{"%", {Dimension::ratio, 1e-2}},
    Spelling{"percent", {Dimension::ratio, 1e-2}},
    Spelling{"pct", {Dimension::ratio, 1e-2}},
    Spelling{"\u2030", {Dimension::ratio, 1e-3}},
    Spelling{"permille", {Dimension::ratio, 1e-3}},
    Spelling{"promille", {Dimension::ratio, 1e-3}},
    Spelling{"1/1000", {Dimension::ratio, 1e-3}},
    Spelling{"01%", {Dimension::ratio, 1e-3}},  // 0.1 %
    Spelling{"count", {Dimension::counts, 1.0}},
    Spelling{"counts", {Dimension::counts, 1.0}},
    Spelling{"cnt", {Dimension::counts, 1.0}},
    Spelling{"cts", {Dimension::counts, 1.0}},
    Spelling{"inc", {Dimension::counts, 1.0}},
    Spelling{"incr", {Dimension::counts, 1.0}},
    Spelling{"increments", {Dimension::counts, 1.0}},
    Spelling{"ink", {Dimension::counts, 1.0}},
    Spelling{"inkremente", {Dimension::counts, 1.0}},
    Spelling{"ticks", {Dimension::counts, 1.0}},
    Spelling{"pulses", {Dimension::counts, 1.0}},
    Spelling{"counts/s", {Dimension::count_rate, 1.0}},
    Spelling{"cnt/s", {Dimension::count_rate, 1.0}},
    Spelling{"inc/s", {Dimension::count_rate, 1.0}},
    Spelling{"ticks/s", {Dimension::count_rate, 1.0}},
    Spelling{"counts/ms", {Dimension::count_rate, 1e3}},
    Spelling{"inc/ms", {Dimension::count_rate, 1e3}},
};

struct Replacement {
  std::string_view from, to;
};
constexpr std::array<Replacement, 13> kReplacements = {{{"\u00b0", "deg"},
                                                        {"\u00ba", "deg"},
                                                        {"\u00b5", "u"},
                                                        {"\u03bc", "u"},
                                                        {"\u00b2", "2"},
                                                        {"\u207b\u00b9", "-1"},
                                                        {"\u00b7", ""},
                                                        {"\u22c5", ""},
                                                        {" ", ""},
                                                        {"*", ""},
                                                        {"^", ""},
                                                        {".", ""},
                                                        {"_", ""}}};

/// A spelling without what people write differently.
std::string bare(std::string_view text) {
  std::string unit = lower(text);
  for (const auto& [from, to] : kReplacements)
    for (std::size_t at = unit.find(from); at != std::string::npos; at = unit.find(from, at + to.size()))
      unit.replace(at, from.size(), to);
  for (const auto& [open, close] : {std::pair('[', ']'), {'(', ')'}, {'<', '>'}})
    if (unit.size() > 2 && unit.front() == open && unit.back() == close)
      unit = unit.substr(1, unit.size() - 2);
  return unit;
}

}  // namespace

std::optional<Unit> known_unit(std::string_view text) {
  if (text == "MN" || text == "[MN]") return Unit{Dimension::force, 1e6};
  if (text == "MNm" || text == "[MNm]") return Unit{Dimension::torque, 1e6};
  const std::string unit = bare(text);
  for (const auto& spelling : kSpellings)
    if (spelling.text == unit) return spelling.unit;
  return std::nullopt;
}

std::string_view base_unit(Dimension dimension) noexcept {
  switch (dimension) {
    case Dimension::time:
      return "s";
    case Dimension::angle:
      return "rad";
    case Dimension::angular_velocity:
      return "rad/s";
    case Dimension::angular_acceleration:
      return "rad/s2";
    case Dimension::length:
      return "m";
    case Dimension::velocity:
      return "m/s";
    case Dimension::acceleration:
      return "m/s2";
    case Dimension::torque:
      return "Nm";
    case Dimension::force:
      return "N";
    case Dimension::current:
      return "A";
    case Dimension::voltage:
      return "V";
    case Dimension::ratio:
      return "1";
    case Dimension::counts:
      return "counts";
    case Dimension::count_rate:
      return "counts/s";
  }
  return {};
}

std::optional<data::OutputQuantity> quantity_of(Dimension dimension) noexcept {
  switch (dimension) {
    case Dimension::angle:
    case Dimension::length:
    case Dimension::counts:
      return data::OutputQuantity::position;
    case Dimension::angular_velocity:
    case Dimension::velocity:
    case Dimension::count_rate:
      return data::OutputQuantity::velocity;
    case Dimension::angular_acceleration:
    case Dimension::acceleration:
      return data::OutputQuantity::acceleration;
    default:
      return std::nullopt;
  }
}

std::optional<data::Motion> motion_of(Dimension dimension) noexcept {
  switch (dimension) {
    case Dimension::angle:
    case Dimension::angular_velocity:
    case Dimension::angular_acceleration:
    case Dimension::torque:
      return data::Motion::rotary;
    case Dimension::length:
    case Dimension::velocity:
    case Dimension::acceleration:
    case Dimension::force:
      return data::Motion::linear;
    default:
      return std::nullopt;
  }
}

NamedUnit take_apart(std::string_view column) {
  const char last = column.empty() ? '\0' : column.back();
  if (last == ']' || last == ')') {
    const std::size_t open = column.rfind(last == ']' ? '[' : '(');
    if (open != std::string_view::npos && open > 0)
      return {trimmed(column.substr(0, open)), trimmed(column.substr(open + 1, column.size() - open - 2))};
  }
  for (const std::string_view mark : {" in ", " / ", ", "}) {  // "n_ist in 1/min", "Drehmoment / Nm"
    const std::size_t at = column.rfind(mark);
    if (at == std::string_view::npos || at == 0) continue;
    const std::string_view unit = column.substr(at + mark.size());
    if (known_unit(unit)) return {trimmed(column.substr(0, at)), trimmed(unit)};
  }
  for (const auto& suffix : kSuffixes) {
    if (column.size() <= suffix.text.size()) continue;
    const std::string_view end = column.substr(column.size() - suffix.text.size());
    if (end == suffix.text || (suffix.any_case && lower(end) == lower(suffix.text)))
      return {std::string(column.substr(0, column.size() - end.size())), std::string(suffix.unit)};
  }
  return {std::string(column), {}};
}

std::string suffix_of(std::string_view unit) {
  for (const auto& suffix : kSuffixes)
    if (suffix.unit == unit) return std::string(suffix.text);
  return {};
}

std::string input_si_unit(data::Motion motion) { return motion == data::Motion::rotary ? "Nm" : "N"; }

std::string output_si_unit(data::Motion motion, data::OutputQuantity quantity) {
  const std::string angle = motion == data::Motion::rotary ? "rad" : "m";
  switch (quantity) {
    case data::OutputQuantity::position:
      return angle;
    case data::OutputQuantity::acceleration:
      return angle + "/s2";
    case data::OutputQuantity::velocity:
      break;
  }
  return angle + "/s";
}

}  // namespace resonid::io
