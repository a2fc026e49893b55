// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/fit/black_box.hpp>
#include <utility>
#include <vector>

namespace resonid::fit {

struct OrderSelectionConfig {
  BlackBoxConfig model;  ///< Everything but the order; its delay is the known one.
  int lowest = 1;        ///< 1 ... highest.
  int highest = 12;      ///< ... 20.
  /// Try a fixed integrator where a pole lies within three standard deviations of z = 1.
  bool integrator = true;
  bool further_delay = false;  ///< Look for one: from one sample less than the known delay to 50 more.
};

/// One order with the delay and integrator that suit it best by the information criterion, fitted without the
/// hold-out samples and judged by them.
struct OrderTrial {
  int order = 0;
  std::size_t delay_samples = 0;
  bool direct_term = false;
  bool integrator = false;
  bool converged = false;
  bool stable = false;
  double mean_square = 0.0;     ///< Mean square of the one-step-ahead errors on the hold-out samples.
  double excess = 0.0;          ///< Mean square above that of the best order.
  double standard_error = 0.0;  ///< Standard error of the excess, from the means of 20 stretches.
  double fit_percent = 0.0;     ///< Fit of the simulation there.
  double bic = 0.0;             ///< Bayesian information criterion of the other samples.

  /// N ln(mean square) of so many samples, as other models are judged by.
  [[nodiscard]] double holdout_score(std::size_t holdout) const;
};

struct OrderSelection {
  int order = 0;
  bool further_delay = false;      ///< Found one; it is a parameter of `fit` then.
  std::size_t holdout = 0;         ///< Samples.
  std::vector<OrderTrial> trials;  ///< In ascending order.
  BlackBoxFit fit;                 ///< Fit of the chosen order to the whole record.
};

/// The last 30 % of each tenth of a record, so that a sweep too is seen over its whole band.
[[nodiscard]] std::vector<std::pair<std::size_t, std::size_t>> holdout_parts(std::size_t samples);

/// Chooses order, integrator and delay of a black-box model. Delay and integrator within an order by the
/// Bayesian information criterion. Between orders by the hold-out data: the lowest order whose mean squared
/// one-step-ahead error exceeds the smallest one by at most two standard errors of that difference (after
/// Breiman et al. 1984), or by no more than 10 in N ln(mean square). Errors made alike by both
/// orders cancel in that comparison, so noise does not ask for high orders. Orders whose fit converged and is
/// stable are preferred. Orders are tried in ascending order until the criterion has grown three times. All
/// of that by the open-loop predictor with a noise model, the last fit by the one asked for. Errors: those of
/// fit_black_box, limits out of range, no order that can be fitted.
[[nodiscard]] expected<OrderSelection, Error> select_order(const data::Record& record,
                                                           const OrderSelectionConfig& config);

}  // namespace resonid::fit
