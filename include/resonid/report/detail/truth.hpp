// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/margins.hpp>
#include <resonid/plant/experiment.hpp>

namespace resonid::report {

/// What `simulate --truth` tells: the truth of a simulated experiment, and the margins of its real loop.
struct SimulatedTruth {
  plant::Truth truth;
  diagnostics::LoopMargins margins;  ///< Of truth.loop; nothing in open loop.
};
[[nodiscard]] SimulatedTruth simulated_truth(plant::Truth truth);

}  // namespace resonid::report
