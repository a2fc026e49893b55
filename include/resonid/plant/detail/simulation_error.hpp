// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/experiment.hpp>
#include <span>

namespace resonid::plant {

/// Why an experiment was not run to its end.
struct SimulationError : Error {
  bool unstable = false;  ///< The experiment is in order, but its closed loop does not stay bounded.
};

/// simulate_closed_loop() for those who look at drives on which a controller may fail.
[[nodiscard]] expected<Simulation, SimulationError> simulate_or_tell(
    const ExperimentConfig& config, std::span<const double> response_hz = {});

}  // namespace resonid::plant
