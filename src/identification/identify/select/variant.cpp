// SPDX-License-Identifier: MIT
#include <identification/identify/select/variant.hpp>

namespace resonid::identification::detail {
namespace {

using fit::Structure;

const char* plain_name(Structure structure) {
  switch (structure) {
    case Structure::rigid:
      return "rigid";
    case Structure::two_mass:
      return "two-mass";
    case Structure::three_mass:
      break;
  }
  return "three-mass";
}

}  // namespace

std::string name_of(const Variant& v) {
  std::vector<const char*> parts;
  if (v.friction) parts.push_back("viscous friction");
  if (v.dry) parts.push_back(v.stribeck ? "dry friction that falls with the speed" : "dry friction");
  if (v.load_dry) parts.push_back("dry friction of the load");
  if (v.has(fit::kLoadViscousFriction)) parts.push_back("viscous friction of the load");
  if (v.has(fit::kMotorGroundStiffness)) parts.push_back("spring to ground");
  if (v.has(fit::kLoadGroundStiffness)) parts.push_back("spring from load to ground");
  if (v.has(fit::kTorqueLag)) parts.push_back("torque lag");
  if (v.has(fit::kOutputFilter)) parts.push_back("output filter");
  if (v.delay) parts.push_back("delay");
  if (v.velocity == fit::Velocity::differences) parts.push_back("velocity by differences");
  std::string name = plain_name(v.structure);
  for (std::size_t i = 0; i < parts.size(); ++i)
    name += std::string(i == 0 ? " with " : i + 1 == parts.size() ? " and " : ", ") + parts[i];
  return name;
}

Variant with(Variant variant, fit::Parameter parameter) {
  if (parameter == fit::kViscousFriction)
    variant.friction = true;
  else if (parameter == fit::kDelay)
    variant.delay = true;
  else
    variant.further.push_back(parameter);
  return variant;
}

Variant grounded_on_other_side(Variant variant) {
  for (auto& p : variant.further)
    if (p == fit::kMotorGroundStiffness)
      p = fit::kLoadGroundStiffness;
    else if (p == fit::kLoadGroundStiffness)
      p = fit::kMotorGroundStiffness;
  return variant;
}

std::size_t parts_of(const Variant& v) {
  const bool viscous = v.friction || v.has(fit::kLoadViscousFriction);
  return v.further.size() + (viscous ? 1 : 0) + (v.delay ? 1 : 0) +
         (v.velocity == fit::Velocity::differences ? 1 : 0) + (v.dry && v.load_dry ? 1 : 0) +
         (v.stribeck ? 2 : 0);
}

double price_of(const Variant& v, const Variant& other, double price) {
  return price * (static_cast<double>(parts_of(v)) - static_cast<double>(parts_of(other)));
}

Variant without_dry_friction(Variant v) {
  v.dry = v.load_dry = v.stribeck = false;
  return v;
}

bool lags(const Variant& v) { return v.has(fit::kTorqueLag) || v.has(fit::kOutputFilter); }

Variant without_lags(Variant v) {
  std::erase_if(v.further, [](fit::Parameter p) { return p == fit::kTorqueLag || p == fit::kOutputFilter; });
  return v;
}

bool implausible(const Variant& variant, const fit::DriveModel& model) {
  constexpr double kClearly = 3.0;  // standard deviations
  return std::any_of(variant.further.begin(), variant.further.end(), [&](fit::Parameter p) {
    const auto e = model.estimate(p);
    return !(e.value > kClearly * e.std);
  });
}

}  // namespace resonid::identification::detail
