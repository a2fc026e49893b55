// SPDX-License-Identifier: MIT
#pragma once

#include <resonid/fit/black_box.hpp>
#include <vector>

namespace resonid::fit {

struct OrderSelectionConfig {
  BlackBoxConfig model;           ///< Everything but the order.
  int lowest = 1;                 ///< 1 ... highest.
  int highest = 12;               ///< ... 20.
  double estimation_share = 0.7;  ///< Of the record, 0.3 ... 0.9; the rest validates.
};

/// One order, fitted to the first part of the record and simulated on the rest.
struct OrderTrial {
  int order = 0;
  bool converged = false;
  bool stable = false;
  double mean_square = 0.0;     ///< Of the simulation's error on the rest.
  double excess = 0.0;          ///< Mean square above that of the best order.
  double standard_error = 0.0;  ///< Of the excess, from the means of 20 stretches.
  double fit_percent = 0.0;     ///< On the rest.
  double information = 0.0;     ///< Bayesian information criterion of the first part.
};

struct OrderSelection {
  int order = 0;
  std::vector<OrderTrial> trials;  ///< In ascending order.
  BlackBoxFit fit;                 ///< Of the chosen order, to the whole record.
};

/// Chooses the order of a black-box model by simulation on a held-back part of the record: the lowest order
/// whose mean squared error exceeds the smallest one by at most two standard errors of that difference
/// (METHOD 8.4; after Breiman et al. 1984). Errors made alike by both orders cancel in that comparison, so
/// noise does not ask for high orders. Orders whose fit converged and is stable are preferred. Errors: those
/// of fit_black_box, limits out of range, no order that can be fitted.
[[nodiscard]] expected<OrderSelection, ConfigError> select_order(const data::Record& record,
                                                                 const OrderSelectionConfig& config);

}  // namespace resonid::fit
