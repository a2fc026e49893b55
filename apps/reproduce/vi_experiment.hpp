// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <optional>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/data/two_mass.hpp>
#include <resonid/online/lines/detail/sweep.hpp>
#include <resonid/plant/experiment.hpp>
#include <span>
#include <vector>

#include "reproduce/runs.hpp"

namespace resonid::reproduction::vi {

/// What the source takes as known in every estimate.
struct Known {
  online::SweepLaw sweep;                            ///< Of a chirp; unused otherwise.
  std::optional<data::TransferFunction> controller;  ///< C
  double delay_s = 0.0;                              ///< Taken out of responses and loops, as published.
};
[[nodiscard]] Known known(const plant::ExperimentConfig& experiment);

/// The record of one run with the known operating point (the constant velocity) taken out of y: the source
/// excites "after the system has been stabilized to the desired velocity". The drives turn without friction,
/// so the torque has no constant part.
[[nodiscard]] data::Record run(const plant::ExperimentConfig& experiment, std::uint64_t seed);
[[nodiscard]] data::Record run_without_noise(plant::ExperimentConfig experiment);

/// Zero-order-hold response of the simulated plant, no delay.
[[nodiscard]] data::FrequencyResponse true_response(plant::ExperimentConfig experiment,
                                                    std::span<const double> frequencies_hz);
/// C G, and with `delay` what the loop really sees.
[[nodiscard]] data::FrequencyResponse true_loop(const plant::ExperimentConfig& experiment,
                                                std::span<const double> frequencies_hz, bool delay);

/// The plant's parameters at the driven shaft; those of a two-mass drive only.
[[nodiscard]] data::TwoMassParameters true_parameters(const plant::ExperimentConfig& experiment);

/// C times a response whose delay was taken out: the source's loop.
[[nodiscard]] data::FrequencyResponse published_loop(data::FrequencyResponse response, const Known& known);

/// The grid of error figures: 2 ... 33 Hz every 0.1 Hz.
[[nodiscard]] std::vector<double> band_grid_hz();

}  // namespace resonid::reproduction::vi
