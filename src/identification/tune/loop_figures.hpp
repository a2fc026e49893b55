// SPDX-License-Identifier: MIT
#pragma once

#include <complex>
#include <cstddef>
#include <span>
#include <vector>

#include "design/posterior.hpp"
#include "identification/tune/robust_law.hpp"

namespace resonid::identification {

/// What figures are given in and of.
struct FigureTask {
  const RobustTask& robust;
  Units units;
  double reference_step = 1.0;
  std::size_t draws = 200;  ///< For intervals and bands.
  bool curves = true;       ///< Worked out too.
};

/// Steps of loops are followed for no more samples than these. Of what has not settled by then overshoot,
/// settling and largest torque of the reference step are no figures of the controller.
inline constexpr double kLongestSteps = 20'000.0;

/// Integrators and delays make a loop lag, by 90 to 270 degrees at its lowest lines: with the first phase
/// within half a turn of this, between -330 and 30 degrees, all loops lie on the same turn, and noise on a
/// phase of 0 turns none of them.
inline constexpr double kUsualPhaseDeg = -150.0;
/// arg L without jumps, the first within half a turn of `first_deg`.
[[nodiscard]] std::vector<double> loop_phase_deg(const std::vector<std::complex<double>>& loop,
                                                 double first_deg = kUsualPhaseDeg);

/// A controller with all its figures on the machine of the first result: intervals over that posterior, worst
/// cases and probabilities over all of them.
[[nodiscard]] TunedController with_figures(const RobustLaw& found, const FigureTask& task);

}  // namespace resonid::identification
