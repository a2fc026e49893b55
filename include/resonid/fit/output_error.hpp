// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/record.hpp>
#include <resonid/fit/drive_model.hpp>
#include <resonid/fit/noise_model.hpp>
#include <utility>
#include <vector>

namespace resonid::fit {

struct OutputErrorConfig {
  DriveModel initial;             ///< Structure and start; a fit to the response is a good one.
  bool viscous_friction = false;  ///< Estimate friction on the driven side.
  bool coulomb_friction = false;  ///< Estimate dry friction (torque times sign of the measured velocity).
  bool delay = false;             ///< Estimate a delay of -1 ... 50 samples on top of the known one.
  double known_delay_s = 0.0;     ///< In the measured output, >= 0.
  bool initial_state = true;      ///< Estimate the state at the record's start; otherwise it is rest.
  bool offset = true;  ///< Estimate a constant torque at the input (load, friction at an operating point).
  bool noise_model = true;  ///< Weight by an autoregressive model of the residual (order 0 if it is white).
  std::size_t max_noise_order = 32;
  /// [from, to) of samples whose output is not used: a validation part. The simulation runs through them.
  std::vector<std::pair<std::size_t, std::size_t>> held_back;
  bool fixed_model =
      false;  ///< Estimate initial state and offset only: simulate a given model on the record.
};

/// What the samples that were held back say of a fit to the others.
struct HeldBackFit {
  std::size_t samples = 0;
  double fit_percent = 0.0;  ///< Of the simulation there.
  double information = 0.0;  ///< N ln(mean square) of what the noise model leaves there, smaller is better.
};

struct OutputErrorFit {
  DriveModel model;
  bool converged = false;
  std::size_t samples = 0;         ///< Residuals used.
  std::optional<Estimate> offset;  ///< Torque added to the input.
  std::optional<Estimate> coulomb_friction;
  std::vector<double> residual;  ///< [sample] output minus simulated output, from first_sample on.
  std::size_t first_sample = 0;
  double fit_percent = 0.0;  ///< 100 (1 - |y - yh| / |y - mean y|), of the simulation, not one step ahead.
  NoiseModel noise;          ///< Of the residual.
  std::optional<HeldBackFit> held_back;
  double information = 0.0;  ///< Bayesian information criterion; comparable on the same record.
};

/// Maximum-likelihood fit of the sampled physical drive to the record itself: the output simulated from the
/// input (METHOD 8.4). With white output noise it reaches the Cramer-Rao bound, in closed loop too; coloured
/// noise is whitened by an autoregressive model found from the residual. Initial state and load torque are
/// estimated with it, so an operating point does no harm. Errors: fewer than 50 samples, a start that is not
/// finite and positive, a delay longer than the record.
[[nodiscard]] expected<OutputErrorFit, ConfigError> fit_output_error(const data::Record& record,
                                                                     const OutputErrorConfig& config);

}  // namespace resonid::fit
