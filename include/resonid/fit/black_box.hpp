// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/noise_model.hpp>
#include <resonid/fit/predictor.hpp>
#include <resonid/fit/uncertain_root.hpp>
#include <span>
#include <vector>

namespace resonid::fit {

struct BlackBoxConfig {
  int order = 3;                  ///< Of A and B, 1 ... 20.
  std::size_t delay_samples = 0;  ///< Whole samples in front of b1: known delay of the measured output.
  bool direct_term = false;       ///< Estimate b0 too; a sampled drive has none.
  bool integrator = false;        ///< Fix one pole at z = 1 (a free drive); it counts in the order.
  bool initial_state = true;      ///< Estimate the state at the record's start; otherwise it is rest.
  bool offset = true;             ///< Estimate a constant at the output.
  bool noise_model = true;        ///< Weight by an autoregressive model of the residual.
  std::size_t max_noise_order = 32;
  Predictor predictor = Predictor::open_loop;
  std::optional<data::TransferFunction> controller;  ///< From velocity error to torque; closed_loop needs it.
  std::optional<data::TransferFunction> initial;     ///< Start; found from the record when absent.
};

/// The model in coordinates that keep their digits at any order: powers of z^-1 lose two of them per state at
/// ten samples per period, and more the faster one samples.
///
///   G(z) = (h0 + h1 z^-1 + z^-m sum c_i F_i(z)) [z^-d/(1 - z^-1)],   F_i(z) = e_i^T (zI - transition)^-1
///   input
///
/// m: 1 with two taps h, else 0. The bracket belongs to a fixed integrator, d: 1 with one tap, else 0.
struct BlackBoxRealisation {
  Eigen::MatrixXd transition;
  Eigen::VectorXd input;
  Eigen::VectorXd output;  ///< c
  Eigen::VectorXd taps;    ///< h
  bool integrator = false;
  Eigen::MatrixXd covariance;  ///< Of [alpha, c, h]: G is divided by 1 + sum alpha_i F_i; alpha is zero here.

  [[nodiscard]] bool present() const noexcept { return output.size() + taps.size() > 0; }
};

/// Rational sampled model B/A of the recorded output, delay apart.
struct BlackBoxModel {
  data::TransferFunction transfer_function;
  std::size_t delay_samples = 0;
  Eigen::MatrixXd covariance;  ///< Of [b0, b1, ..., a1, a2, ...]; rows of what is not estimated are zero.
  BlackBoxRealisation realisation;  ///< What response, poles and zeros are computed from, if it is present.

  /// Without delay, with total standard deviation.
  [[nodiscard]] data::FrequencyResponse response(std::span<const double> frequencies_hz) const;
  /// In the z-plane. First-order covariances; those of nearly cancelling or nearly double roots are far too
  /// small or large.
  [[nodiscard]] std::vector<UncertainRoot> poles() const;
  [[nodiscard]] std::vector<UncertainRoot> zeros() const;
};

struct BlackBoxFit {
  BlackBoxModel model;
  bool converged = false;
  /// No pole outside the unit circle; one that differs from z = 1 by no more than three standard deviations
  /// is an integrator.
  bool stable = false;
  std::size_t samples = 0;       ///< Residuals used.
  std::vector<double> residual;  ///< [sample] output minus simulated output, from first_sample on.
  std::size_t first_sample = 0;
  double fit_percent = 0.0;  ///< 100 (1 - |y - yh|/|y - mean y|), of the simulation.
  NoiseModel noise;
  double information = 0.0;  ///< Bayesian information criterion; comparable on the same record.
};

/// Prediction-error fit of an output-error model of any order, y = q^-d B/A u + noise (METHOD 8.4).
[[nodiscard]] expected<BlackBoxFit, ConfigError> fit_black_box(const data::Record& record,
                                                               const BlackBoxConfig& config);

/// Output of another record minus the model's simulation of it; initial state and constant are estimated
/// there. Of `config` the predictor, the controller and these two options are used. Begins at sample
/// delay_samples (closed loop: 0).
[[nodiscard]] expected<std::vector<double>, ConfigError> simulation_residual(const data::Record& record,
                                                                             const BlackBoxModel& model,
                                                                             const BlackBoxConfig& config);

}  // namespace resonid::fit
