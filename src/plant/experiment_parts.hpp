// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/detail/simulation_error.hpp>
#include <resonid/plant/experiment.hpp>

#include "plant/machine.hpp"

namespace resonid::plant {

/// The error with its field as "TABLE.FIELD" of an experiment file.
[[nodiscard]] Error located(std::string_view table, const Error& error);
[[nodiscard]] MachineConfig machine_of(const ExperimentConfig& config);
/// check(), which tells a loop that is not stable from everything else.
[[nodiscard]] expected<void, SimulationError> checked(const ExperimentConfig& config);
/// Samples of the record. The excitation must be valid.
[[nodiscard]] expected<std::size_t> length_of(const ExperimentConfig& config);
/// What is true of the machine at the start; `response_hz` as of simulate_closed_loop().
[[nodiscard]] Truth truth_of(const ExperimentConfig& config, const Drive& drive, const Controller& controller,
                             std::span<const double> response_hz);

}  // namespace resonid::plant
