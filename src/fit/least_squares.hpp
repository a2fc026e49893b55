// SPDX-License-Identifier: MIT
#pragma once

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

namespace resonid::fit::detail {

struct LeastSquaresResult {
  bool converged = false;
  double cost = 0.0;         ///< Half the sum of squares.
  Eigen::MatrixXd jacobian;  ///< [residual, active parameter]
  Eigen::VectorXd gradient;  ///< [active parameter] Of the cost; not 0 at a bound.
  std::vector<int> active;   ///< Index of each column of the Jacobian.
};

struct Bound {
  int parameter = 0;
  double lower = 0.0;
  double upper = 0.0;
};

struct Effort {
  int iterations = 100;
  double function_tolerance = 1e-14;
};

/// Levenberg-Marquardt (Ceres) over one parameter block; parameters that are not active keep their value.
LeastSquaresResult minimise(std::unique_ptr<ceres::CostFunction> function, std::span<double> x,
                            std::span<const bool> active, std::span<const Bound> bounds = {},
                            const Effort& effort = {});

/// The same of a cost that is linear in the active parameters: one evaluation does.
LeastSquaresResult minimise_linear(const ceres::CostFunction& function, std::span<double> x,
                                   std::span<const bool> active);

/// (J^T J)^-1; singular directions are dropped and reported by `full_rank`.
Eigen::MatrixXd inverse_normal_matrix(const Eigen::MatrixXd& jacobian, bool* full_rank = nullptr);

/// The same for a result, spread over all parameters (zero rows for those not active).
Eigen::MatrixXd covariance(const LeastSquaresResult& result, int parameters, bool* full_rank = nullptr);

}  // namespace resonid::fit::detail
