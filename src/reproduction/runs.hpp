// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/plant/experiment.hpp>
#include <span>
#include <vector>

namespace resonid::reproduction {

/// A run of a shipped experiment or of a variation of one. Asserts that it is valid. The truth holds the
/// zero-order-hold response at the frequencies given.
[[nodiscard]] plant::Simulation simulated(const plant::ExperimentConfig& experiment,
                                          std::span<const double> frequencies_hz = {});

/// `low`, `low + step` ... up to `high`.
[[nodiscard]] std::vector<double> grid_hz(double low, double high, double step);

}  // namespace resonid::reproduction
