// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>

namespace resonid::fit {

/// A pole or zero with the covariance of its real and imaginary part.
struct UncertainRoot {
  std::complex<double> value;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

}  // namespace resonid::fit
