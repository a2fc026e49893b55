// SPDX-License-Identifier: MIT
#include "plant/machine.hpp"

#include <algorithm>
#include <cmath>

namespace resonid::plant {
namespace {

/// Lowest and highest stiffness of a tooth belt over its stroke. It has one minimum at most.
std::pair<double, double> stiffness_range(const DriveConfig& c) {
  const double lowest_at =
      std::clamp(0.5 * (c.upper_length_m + c.lower_length_m), c.stroke_from_m, c.stroke_to_m);
  const double ends[] = {tooth_belt_stiffness(c, c.stroke_from_m), tooth_belt_stiffness(c, c.stroke_to_m)};
  return {std::min({ends[0], ends[1], tooth_belt_stiffness(c, lowest_at)}), std::max(ends[0], ends[1])};
}

}  // namespace

Machine::Machine(MachineConfig config, double longest_s) : config_(std::move(config)) {
  const DisturbanceConfig& d = config_.disturbance;
  const double fault_s = std::min(d.loosening_at_s, longest_s);
  const double loose_s = std::min(fault_s + d.loosening_over_s, longest_s);
  const auto include = [&](double factor) {
    lowest_ = std::min(lowest_, factor);
    highest_ = std::max(highest_, factor);
  };
  include(1.0 + d.stiffness_drift_per_s * fault_s);
  for (const double time : {fault_s, loose_s, longest_s}) include(stiffness_factor(d, time));
  // While it comes loose (1 + d t)(1 - p (t - t0)/T) may turn: at the mean of its roots.
  const double top_s =
      0.5 * (d.loosening_over_s / d.loosening + d.loosening_at_s - 1.0 / d.stiffness_drift_per_s);
  if (top_s > fault_s && top_s < loose_s) include(stiffness_factor(d, top_s));
  if (config_.drive.structure == Structure::tooth_belt) {
    nominal_stiffness_ = tooth_belt_stiffness(config_.drive, config_.drive.stroke_from_m);
    const auto [low, high] = stiffness_range(config_.drive);
    lowest_ *= low / nominal_stiffness_;
    highest_ *= high / nominal_stiffness_;
  }
}

double Machine::factor(double time_s, double place) const noexcept {
  double factor = stiffness_factor(config_.disturbance, time_s);
  if (config_.drive.structure == Structure::tooth_belt) {
    const double inside = std::clamp(place, config_.drive.stroke_from_m, config_.drive.stroke_to_m);
    factor *= tooth_belt_stiffness(config_.drive, inside) / nominal_stiffness_;
  }
  return std::clamp(factor, lowest_, highest_);
}

MassSystem Machine::system(double factor) const {
  return mass_system(config_.drive, factor, config_.drive.stroke_from_m);
}

double Machine::place(double driven_angle, double load_angle) const noexcept {
  return config_.drive.structure == Structure::tooth_belt ? config_.drive.radius_m * load_angle
                                                          : driven_angle;
}

double Machine::load_torque(double time_s) const noexcept {
  const DisturbanceConfig& d = config_.disturbance;
  double torque = d.load_torque;
  for (std::size_t i = 0; i < d.load_step.size(); ++i)
    if (time_s >= d.load_step_at_s[i]) torque += d.load_step[i];
  return torque;
}

double Machine::stretch(double driven_angle) const noexcept {
  const double radius = config_.drive.radius_m;
  return (radius > 0.0 ? config_.disturbance.eccentricity / radius : config_.disturbance.eccentricity) *
         std::sin(driven_angle);
}

bool Machine::disturbed() const noexcept {
  const DisturbanceConfig& d = config_.disturbance;
  return d.load_torque != 0.0 || !d.load_step.empty() || d.eccentricity != 0.0;
}

}  // namespace resonid::plant
