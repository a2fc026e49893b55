// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <identification/identify/prepare/units.hpp>

namespace resonid::identification::detail {
namespace {

/// Unit of the velocity that belongs to an output of any quantity.
std::string velocity_unit(data::OutputQuantity quantity, const std::string& unit) {
  switch (quantity) {
    case data::OutputQuantity::velocity:
      return unit;
    case data::OutputQuantity::position:
      return unit + "/s";
    case data::OutputQuantity::acceleration:
      if (unit.size() > 3 && unit.ends_with("/s2")) return unit.substr(0, unit.size() - 1);
      return unit + " s";
  }
  return unit;
}

bool compound(const std::string& unit) {
  return unit.find('/') != std::string::npos || unit.find(' ') != std::string::npos;
}

}  // namespace

std::string position_unit(const std::string& velocity) {
  return velocity.ends_with("/s") ? velocity.substr(0, velocity.size() - 2) : velocity + " s";
}

Units units_of(const data::Record& record) {
  return units_of(record.motion, record.output_quantity, record.input.unit, record.output.unit);
}

Units units_of(data::Motion motion, data::OutputQuantity quantity, const std::string& input,
               const std::string& output) {
  const bool rotary = motion == data::Motion::rotary;
  Units u;
  u.input = input;
  u.velocity = velocity_unit(quantity, output);
  u.response = (compound(u.velocity) ? "(" + u.velocity + ")" : u.velocity) + "/" + u.input;
  u.torque = u.input;
  u.physical = rotary ? u.input == "Nm" && u.velocity == "rad/s" : u.input == "N" && u.velocity == "m/s";
  if (u.physical) {
    u.inertia = rotary ? "kgm2" : "kg";
    u.stiffness = rotary ? "Nm/rad" : "N/m";
    u.damping = rotary ? "Nms/rad" : "Ns/m";
    return u;
  }
  const auto position = position_unit(u.velocity);
  u.inertia = fmt::format("{} s2/{}", u.input, position);
  u.stiffness = fmt::format("{}/{}", u.input, position);
  u.damping = fmt::format("{} s/{}", u.input, position);
  return u;
}

}  // namespace resonid::identification::detail
