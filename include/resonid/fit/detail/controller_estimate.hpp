// SPDX-License-Identifier: MIT
#pragma once

#include <optional>
#include <resonid/data/record.hpp>
#include <resonid/data/transfer_function.hpp>
#include <resonid/fit/black_box.hpp>
#include <span>

namespace resonid::fit {

/// The controller that a record shows, from velocity error to torque.
struct ControllerEstimate {
  data::TransferFunction controller;
  double input_noise = 0.0;     ///< rms of what u - ru lacks to be C (r - y), in units of u; 0: exact.
  double relative_noise = 0.0;  ///< The same, relative to the rms of u - ru.
  /// [sample] The noise itself, of the samples that were used; empty: exact. u without it is what the
  /// controller commanded.
  std::vector<double> noise;
  std::optional<BlackBoxModel> model;  ///< The same controller with its covariance; absent: exact.
};

/// C of u - ru = C (r - y) + n by the prediction-error method. y is what the controller itself is fed, its
/// noise included, so that nothing but the noise n of the recorded input lies between both sides, and open
/// loop methods are right. Without n: identified_controller(), exact. Else of order 1 ... 4, with or without
/// integrator, by the Bayesian criterion over at most the first 100 000 samples; an absent reference is a
/// constant. Nothing when u - ru is no more than noise (C explains less than 20 % of its size), or when what
/// C leaves still follows ru or y by a correlation of 0.05 and beyond chance: the controller limits, or ru
/// reaches u otherwise. Needs an excitation; of a velocity.
[[nodiscard]] std::optional<ControllerEstimate> estimate_controller(const data::Record& record);

/// One controller of repeated experiments: the records' own estimates of the structure that most show, the
/// coefficients averaged by the power of their noise and the records' lengths; the covariance of `model` is
/// that of the mean. The first record's where one is exact; nothing where the first shows none.
[[nodiscard]] std::optional<ControllerEstimate> estimate_controller(std::span<const data::Record> records);

}  // namespace resonid::fit
