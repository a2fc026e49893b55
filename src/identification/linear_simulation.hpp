// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/drive_model.hpp>
#include <span>
#include <vector>

namespace resonid::identification::detail {

struct LinearSimulation {
  std::vector<double> output;            ///< [sample]
  std::optional<data::Estimate> offset;  ///< Constant added to the input; absent where it cannot be told.
};

/// Output of a transfer function for an input, with the initial state, a constant at the input and
/// (`constant`) one at the output that come nearest to `measured`: linear least squares over the free
/// responses delta(k-i)/A.
[[nodiscard]] LinearSimulation simulate_nearest(const data::TransferFunction& g,
                                                std::span<const double> input,
                                                std::span<const double> measured, bool constant);

/// G delayed by whole samples.
[[nodiscard]] data::TransferFunction delayed(data::TransferFunction g, std::size_t samples);

/// G/(1 + C G), from excitation to output.
[[nodiscard]] data::TransferFunction closed_loop(const data::TransferFunction& g,
                                                 const data::TransferFunction& controller);

[[nodiscard]] double largest_pole(const data::TransferFunction& g);

/// Whether free motion stays bounded over so many samples: no pole outside the unit circle, or so little (an
/// estimated integrator) that it grows at most twentyfold.
[[nodiscard]] bool can_be_simulated(const data::TransferFunction& g, std::size_t samples);

}  // namespace resonid::identification::detail
