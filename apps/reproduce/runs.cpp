// SPDX-License-Identifier: MIT
#include "reproduce/runs.hpp"

#include <cassert>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>

namespace resonid::reproduction {

plant::Simulation simulated(const plant::ExperimentConfig& experiment,
                            std::span<const double> frequencies_hz) {
  auto simulation = plant::simulate_closed_loop(experiment, frequencies_hz);
  assert(simulation && "a shipped experiment, or a variation of one, must run");
  return std::move(*simulation);
}

std::vector<double> grid_hz(double low, double high, double step) {
  std::vector<double> grid;
  const auto count = static_cast<std::size_t>(std::floor((high - low) / step + 1e-6)) + 1;
  for (std::size_t i = 0; i < count; ++i) grid.push_back(low + static_cast<double>(i) * step);
  return grid;
}

std::vector<double> spectrum(const std::vector<double>& signal, double sample_rate_hz,
                             std::span<const double> frequencies_hz) {
  std::vector<double> magnitude;
  for (const double f : frequencies_hz) {
    std::complex<double> sum;
    for (std::size_t k = 0; k < signal.size(); ++k)
      sum += signal[k] * std::polar(1.0, -kTwoPi * f * static_cast<double>(k) / sample_rate_hz);
    magnitude.push_back(std::abs(sum) / sample_rate_hz);
  }
  return magnitude;
}

}  // namespace resonid::reproduction
