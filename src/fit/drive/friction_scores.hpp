// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <fit/drive/friction_fit.hpp>
#include <resonid/fit/output_error.hpp>
#include <vector>

// Dry friction beside Coulomb's on the driven side: its coordinates, and tests of what of it is lacking.
namespace resonid::fit::detail {

/// Places of the coordinates of what is given, ascending.
[[nodiscard]] std::vector<int> coordinates_of(const FurtherFriction& friction);
[[nodiscard]] std::vector<Bound> friction_bounds(const FurtherFriction& friction);
void store_friction(double coulomb, const FurtherFriction& friction, std::vector<double>& x);
/// What of `asked` was found, with its deviations.
[[nodiscard]] FurtherFriction further_friction_of(const FurtherFriction& asked, const std::vector<double>& x,
                                                  const Eigen::MatrixXd& covariance);

/// Lagrange multiplier tests at x, along the course of friction as it moves, of what `estimated` leaves out:
/// friction on the load, Stribeck's. `covariance` of all coordinates.
[[nodiscard]] std::vector<LackingFriction> score_friction(const FrictionProblem& problem,
                                                          const std::vector<double>& x,
                                                          const Eigen::MatrixXd& covariance,
                                                          const FurtherFriction& estimated, bool driven);

}  // namespace resonid::fit::detail
