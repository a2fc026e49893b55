// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/design/detail/loop_figures.hpp>

#include "design/closed_loop.hpp"
#include "design/machine.hpp"

namespace resonid::design {

[[nodiscard]] LoadStep load_step_of(const ClosedLoop& loop, double spectral_radius);

/// `share`: of the lines that are looked at first (first_lines_hz).
[[nodiscard]] LoopFigures figures_of(const Machine& machine, const LinearController& controller,
                                     double share = 1.0);
[[nodiscard]] inline LoopFigures figures_of(const Machine& machine, const FilteredPi& controller) {
  return figures_of(machine, LinearController(controller, machine.sample_time_s()));
}

}  // namespace resonid::design
