// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <array>
#include <resonid/fit/drive_model.hpp>
#include <vector>

namespace resonid::fit::detail {

/// What a drive may have beside its structure, in the order of trying.
inline constexpr std::array kFurtherTried = {kViscousFriction,    kDelay,        kLoadViscousFriction,
                                             kTorqueLag,          kOutputFilter, kMotorGroundStiffness,
                                             kLoadGroundStiffness};

/// Lagrange multiplier tests: what of the residual follows the slope by a parameter that is not estimated,
/// beyond what the estimated ones take up. Columns of `factor`: slopes of the `estimated`, of those in
/// `found`, residual.
void score(const Eigen::MatrixXd& factor, Eigen::Index estimated, double variance,
           std::vector<Lacking>& found);

}  // namespace resonid::fit::detail
