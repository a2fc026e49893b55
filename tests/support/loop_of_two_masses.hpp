// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/experiment.hpp>

namespace resonid::test {

/// Two masses under a PI velocity controller; nothing measured amiss and nothing injected yet.
inline plant::ExperimentConfig loop_of_two_masses(double driven_inertia, double load_inertia,
                                                  double stiffness, double damping, double gain,
                                                  double integral_time_s) {
  plant::ExperimentConfig c;
  c.drive.driven_inertia = driven_inertia;
  c.drive.load_inertia = load_inertia;
  c.drive.stiffness = stiffness;
  c.drive.damping = damping;
  c.controller.kind = plant::ControllerKind::pi;
  c.controller.gain = gain;
  c.controller.integral_time_s = integral_time_s;
  return c;
}

}  // namespace resonid::test
