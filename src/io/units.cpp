// SPDX-License-Identifier: MIT
#include "io/units.hpp"

#include <array>
#include <cstddef>

#include "io/text.hpp"

namespace resonid::io {
namespace {

struct Suffix {
  std::string_view text;
  std::string_view unit;
  bool any_case;  // a single letter or a prefix means something else in the other case
};

// The longest match counts, so that "_rad_s" is not taken for "_s".
constexpr std::array<Suffix, 28> kSuffixes = {{
    {"_rad_s2", "rad/s2", true}, {"_deg_s2", "deg/s2", true}, {"_mm_s2", "mm/s2", true},
    {"_m_s2", "m/s2", true},     {"_rad_s", "rad/s", true},   {"_deg_s", "deg/s", true},
    {"_mm_s", "mm/s", true},     {"_m_s", "m/s", true},       {"_mrad", "mrad", false},
    {"_rad", "rad", true},       {"_deg", "deg", true},       {"_rpm", "rpm", true},
    {"_mNm", "mNm", false},      {"_Nm", "Nm", true},         {"_kN", "kN", false},
    {"_N", "N", false},          {"_mA", "mA", false},        {"_A", "A", false},
    {"_mV", "mV", false},        {"_V", "V", false},          {"_mm", "mm", true},
    {"_um", "um", true},         {"_m", "m", false},          {"_ms", "ms", true},
    {"_us", "us", true},         {"_ns", "ns", true},         {"_s", "s", true},
    {"_Hz", "Hz", true},
}};

std::string trimmed(std::string_view text) {
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  return std::string(text);
}

}  // namespace

NamedUnit take_apart(std::string_view column) {
  const char last = column.empty() ? '\0' : column.back();
  if (last == ']' || last == ')') {
    const std::size_t open = column.rfind(last == ']' ? '[' : '(');
    if (open != std::string_view::npos && open > 0)
      return {trimmed(column.substr(0, open)), trimmed(column.substr(open + 1, column.size() - open - 2))};
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
