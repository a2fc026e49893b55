// SPDX-License-Identifier: MIT
#pragma once

#include <identification/measurement.hpp>

namespace resonid::identification::detail {

/// A black-box model of the record and how it was come by.
struct BlackBoxSelection {
  BlackBoxResult result;
  std::vector<double> residual;  ///< Of the simulation, from residual_start on.
  std::size_t residual_start = 0;
  std::vector<StructureTrial> structures;  ///< One for each order that was tried.
  Choice choice;                           ///< Of the order.
  std::vector<diagnostics::Finding> findings;
};

/// Output error of the order asked for, else of the order that a held-back part of the record prefers. An
/// approach that was asked for decides on the predictor too; else the recorded input drives it and the noise
/// is modelled, which is right in open and in closed loop.
[[nodiscard]] expected<BlackBoxSelection, Refusal> select_black_box(const data::Record& record,
                                                                    const Options& options);

/// Oscillating poles and zeros of it, undamped, from `low_hz` to `high_hz`.
[[nodiscard]] std::vector<Resonance> resonances_of(const fit::BlackBoxModel& model, double low_hz,
                                                   double high_hz);

}  // namespace resonid::identification::detail
