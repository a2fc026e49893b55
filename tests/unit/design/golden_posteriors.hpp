// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>

#include "design/posterior.hpp"
#include "golden_machines.hpp"

namespace resonid::test {

/// System 2 with a golden covariance of (ln J1, ln J2, ln K, ln D, delay).
inline design::Posterior golden_posterior(const nlohmann::json& one) {
  const std::vector<double> v = one.at("v0");
  const auto machine =
      golden_machine({std::exp(v[0]), std::exp(v[1]), std::exp(v[2]), std::exp(v[3])}, 0.002, v[4]);
  Eigen::MatrixXd covariance(5, 5);
  for (Eigen::Index i = 0; i < 5; ++i)
    for (Eigen::Index j = 0; j < 5; ++j)
      covariance(i, j) = one.at("covariance")[static_cast<std::size_t>(i)][static_cast<std::size_t>(j)];
  return {machine.model(),
          {fit::kDrivenInertia, fit::kLoadInertia, fit::kStiffness, fit::kDamping, fit::kDelay},
          covariance};
}

/// The bounds that are met unless others are asked for (docs/methods/tune.md 5.1).
inline design::Bounds calm() {
  design::Bounds bounds;
  bounds.sensitivity = 1.4;
  bounds.load_transfer = 1.3;
  return bounds;
}

}  // namespace resonid::test
