// SPDX-License-Identifier: MIT
#pragma once

#include <fit/black_box/black_box_problem.hpp>
#include <memory>
#include <resonid/fit/black_box.hpp>

namespace resonid::fit::detail {

/// The recorded signals that the predictor uses.
struct Recorded {
  std::vector<double> input, output, excitation, reference;
  std::vector<double> projected;  ///< The input without noise; empty in open loop.
  std::vector<bool> unused;       ///< [sample] hold-out; or empty.
};

/// Checks record and configuration, projects the input where the predictor asks for it.
[[nodiscard]] expected<Recorded, Error> recorded(const data::Record& record, const BlackBoxConfig& config);

/// Whitened and aligned so that input[k] and output[k] belong together. Filtering by the noise model commutes
/// with plant and controller, all being linear.
[[nodiscard]] BlackBoxSignals prepared(const Recorded& raw, const NoiseModel& noise,
                                       const BlackBoxConfig& config);

/// The problem keeps a reference to the signals.
[[nodiscard]] std::unique_ptr<BlackBoxProblem> problem_of(const BlackBoxSignals& signals,
                                                          const BlackBoxConfig& config);

}  // namespace resonid::fit::detail
