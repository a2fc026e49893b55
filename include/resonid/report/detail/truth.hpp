// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/diagnostics/margins.hpp>
#include <resonid/plant/experiment.hpp>
#include <resonid/report/detail/document.hpp>

namespace resonid::report {

/// What `simulate --truth` tells: the truth of a simulated experiment, and the margins of its real loop.
struct SimulatedTruth {
  plant::Truth truth;
  diagnostics::LoopMargins margins;  ///< Margins of truth.loop; nothing in open loop.
};
[[nodiscard]] SimulatedTruth simulated_truth(plant::Truth truth);

/// The page of `simulate --report`: what is true of the machine and its loop, and the record.
[[nodiscard]] Document document(const plant::Simulation& simulation);

}  // namespace resonid::report
