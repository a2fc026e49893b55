// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <fit/drive/drive_simulation.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <resonid/fit/output_error.hpp>
#include <span>
#include <vector>

// Whether the machine bends: torques that no linear drive has, told from what a linear model leaves.
namespace resonid::fit::detail {

/// What was found, and what is left of the parameters' inconstancy when it is taken out.
struct BendingTest {
  std::vector<Bending> found;        ///< The strongest first, each beside those before it.
  std::vector<Constancy> constancy;  ///< In coordinates; empty where nothing was found.
  double left = 0.0;                 ///< Mean square of the whitened residual without all of them.
};

/// Score tests at coordinates `x` of the raw signals. Each torque, computed from the simulated motion, acts
/// where it belongs and goes through the linear drive, in its loop, to the output. Slopes by everything
/// linear, that of parameters that are not estimated too, are taken out of it beforehand, so that a linear
/// machine that the model misses does not pass for a bent one. What is found has less than one chance in a
/// thousand, all torques together, of being noise; its variance allows for a residual that is neither even
/// nor quite white (Newey and West 1987). `estimated`: coordinates below kParameterCount; `own`: those of the
/// record.
[[nodiscard]] BendingTest bending_of(const SimulationSetup& setup, const DriveSignals& raw,
                                     std::span<const double> x, std::span<const int> estimated,
                                     std::span<const int> own, const NoiseModel& noise);

}  // namespace resonid::fit::detail
