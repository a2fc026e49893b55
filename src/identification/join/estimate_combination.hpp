// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/fit/output_error.hpp>
#include <vector>

namespace resonid::identification::detail {

/// Estimated parameters in coordinates in which they are nearly Gaussian, logarithms of the positive ones.
/// Only those count that are determined: with a standard deviation of a logarithm above 1 the covariance says
/// nothing but that the parameter is not known, and it is left out of `known` (not taken as exact: what the
/// others say is marginal over it).
struct ParameterEstimate {
  std::vector<int> parameters;  ///< fit::Parameter of each coordinate.
  Eigen::VectorXd x;
  Eigen::MatrixXd fisher_information;  ///< Inverse covariance of the known ones; zero rows for the others.
  std::vector<Eigen::Index> known;
};

/// Of the parameters that the model says are estimated; `known` is empty where its covariance is none.
[[nodiscard]] ParameterEstimate estimate_of(const fit::DriveModel& model);

/// (sum I_i)^-1 sum I_i x_i over all but one, of the same parameters; `known` what any of them knows.
[[nodiscard]] ParameterEstimate combined(const std::vector<ParameterEstimate>& all, std::size_t but);

/// The known parameters and their covariance put into a model of the same structure.
void store(const ParameterEstimate& estimate, fit::DriveModel& model);

/// (x_a - x_b)' (C_a + C_b)^-1 (x_a - x_b) over what both know; the degrees of freedom are 0 where that is
/// nothing.
[[nodiscard]] fit::Consistency distance(const ParameterEstimate& a, const ParameterEstimate& b);

}  // namespace resonid::identification::detail
