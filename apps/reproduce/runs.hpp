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

/// |sum x[k] e^{-j 2 pi f k / rate}| / rate at each frequency: the magnitude of the Fourier transform of a
/// signal that is 0 outside, in its unit times seconds.
[[nodiscard]] std::vector<double> spectrum(const std::vector<double>& signal, double sample_rate_hz,
                                           std::span<const double> frequencies_hz);

}  // namespace resonid::reproduction
