// SPDX-License-Identifier: MIT
#include <identification/identify/prepare/units.hpp>
#include <monitoring/axis_spec.hpp>

namespace resonid::monitoring {

SampleUnits sample_units(const AxisSpec& spec) {
  const bool linear = spec.motion == data::Motion::linear;
  SampleUnits units{spec.input_unit, spec.output_unit};
  if (units.input.empty()) units.input = linear ? "N" : "Nm";
  if (!units.output.empty()) return units;
  units.output = linear ? "m" : "rad";
  if (spec.output_quantity == data::OutputQuantity::velocity) units.output += "/s";
  if (spec.output_quantity == data::OutputQuantity::acceleration) units.output += "/s2";
  return units;
}

identification::Units figure_units(const AxisSpec& spec) {
  const auto [input, output] = sample_units(spec);
  return identification::detail::units_of(spec.motion, spec.output_quantity, input, output);
}

std::string_view unit_of(Watched figure, const identification::Units& units) noexcept {
  switch (figure) {
    case Watched::stiffness:
      return units.stiffness;
    case Watched::driven_inertia:
    case Watched::load_inertia:
      return units.inertia;
    case Watched::damping:
      return units.damping;
    case Watched::coulomb_friction:
    case Watched::load_torque:
      return units.torque;
    default:
      return {};
  }
}

}  // namespace resonid::monitoring
