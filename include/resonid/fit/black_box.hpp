// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <resonid/base/expected.hpp>
#include <resonid/data/estimate.hpp>
#include <resonid/data/frequency_response.hpp>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <resonid/fit/detail/predictor.hpp>
#include <resonid/fit/detail/uncertain_root.hpp>
#include <span>
#include <utility>
#include <vector>

namespace resonid::fit {

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
  /// Covariance of [alpha, c, h]; alpha, 0 here, divides G by 1 + sum alpha_i F_i.
  Eigen::MatrixXd covariance;

  [[nodiscard]] bool present() const noexcept { return output.size() + taps.size() > 0; }
};

struct BlackBoxConfig {
  int order = 3;                  ///< Order of A and B, 1 ... 20.
  std::size_t delay_samples = 0;  ///< Whole samples in front of b1 (of b0 with a direct term).
  /// Estimate b0 too. With d = delay_samples > 0 it stands for a delay of a fraction of a sample, anything
  /// from d - 1 to d samples; without delay a sampled drive has none.
  bool direct_term = false;
  bool integrator = false;     ///< Fix one pole at z = 1 (a free drive); it counts in the order.
  bool initial_state = true;   ///< Estimate the state at the record's start; otherwise it is rest.
  bool offset = true;          ///< Estimate a constant at the output.
  bool noise_model = true;     ///< Weight by an autoregressive model of the residual.
  double known_delay_s = 0.0;  ///< In the measured output; part of delay_samples, taken out of the response.
  std::size_t max_noise_order = 32;
  Predictor predictor = Predictor::open_loop;
  std::optional<data::TransferFunction> controller;  ///< From velocity error to torque; closed_loop needs it.
  std::optional<data::TransferFunction> initial;     ///< Start; found from the record when absent.
  BlackBoxRealisation start;  ///< The same as a model found before, when present; of this or a lower order.
  /// Ranges [from, to) of samples that take no part in the fit; simulated over all the same.
  std::vector<std::pair<std::size_t, std::size_t>> holdout;
  bool quick = false;  ///< Coarse end of the search and one turn of the noise model: to compare candidates.
};

/// Rational sampled model B/A of the recorded output, delay apart.
struct BlackBoxModel {
  data::TransferFunction transfer_function;
  std::size_t delay_samples = 0;
  double known_delay_s = 0.0;
  Eigen::MatrixXd covariance;  ///< Covariance of [b0, b1, ..., a1, a2, ...]; 0 for what is not estimated.
  BlackBoxRealisation realisation;  ///< What response, poles and zeros are computed from, if it is present.

  /// Without the known delay, a further one is in it; with total standard deviation.
  [[nodiscard]] data::FrequencyResponse response(std::span<const double> frequencies_hz) const;
  /// Whole delay in s, the known one included, of a plant that is driven through a zero-order hold and does
  /// not answer at once. With a direct term behind at least one sample it is a parameter: of the n + 1
  /// coefficients of B one tells at which time between two samples the output is taken,
  ///
  ///   G(z) = z^-d (h + sum_i r_i/(z - p_i)),   h = sum_i r_i (1 - p_i^-m)/(p_i - 1),   delay = (d - m) Ts
  ///
  /// Otherwise whole samples, with standard deviation 0. Nothing where a pole is zero or negative, which no
  /// such plant has, or no m in (-1, 2) solves this.
  [[nodiscard]] std::optional<data::Estimate> delay() const;
  /// The same model with its parameters moved along [alpha, c, h]; needs the realisation. The covariance
  /// stays.
  [[nodiscard]] BlackBoxModel moved(const Eigen::VectorXd& step) const;
  /// Standard deviation of a scalar function of the model, to first order in the covariance; 0 without a
  /// realisation.
  [[nodiscard]] double standard_deviation_of(
      const std::function<double(const BlackBoxModel&)>& function) const;
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
  double bic = 0.0;  ///< Bayesian information criterion; comparable on the same record.
  /// [sample of the record] One-step-ahead errors of the hold-out samples; NaN elsewhere. Empty without any.
  std::vector<double> holdout;
  double holdout_fit_percent = 0.0;  ///< fit_percent of the hold-out samples.
};

/// Prediction-error fit of an output-error model of any order, y = q^-d B/A u + noise (Ljung 1999, ch. 7).
[[nodiscard]] expected<BlackBoxFit, Error> fit_black_box(const data::Record& record,
                                                         const BlackBoxConfig& config);

/// Output of another record minus the model's simulation of it; initial state and constant are estimated
/// there. Of `config` the predictor, the controller and these two options are used. Begins at sample
/// delay_samples (closed loop: 0).
[[nodiscard]] expected<std::vector<double>, Error> simulation_residual(const data::Record& record,
                                                                       const BlackBoxModel& model,
                                                                       const BlackBoxConfig& config);

}  // namespace resonid::fit
