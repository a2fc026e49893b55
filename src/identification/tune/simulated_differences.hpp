// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/identification/tune.hpp>
#include <resonid/plant/experiment.hpp>

// What a simulated drive does otherwise than was promised, and why (docs/methods/tune.md 17.7).
namespace resonid::identification {

/// The identified machine as the simulation takes it.
[[nodiscard]] plant::DriveConfig drive_config_of(const fit::DriveModel& model);

/// A figure of the drive's own loop beyond its bound: a finding, and the design is not trusted.
void compare_with_bound(Tuning& tuning, const plant::ExperimentConfig& experiment, const LoopFigure& figure,
                        double simulated, double at_hz);

/// Figures of a run of the proposed controller that are not as promised: one finding. `experiment` is that of
/// the run; `cut`: it ended before the loop had settled.
void compare_with_promise(Tuning& tuning, const plant::ExperimentConfig& experiment, const SimulatedRun& run,
                          bool cut);

}  // namespace resonid::identification
