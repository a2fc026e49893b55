// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <complex>

namespace resonid::plant::test {

/// Of a real matrix in long double; an object of its own, since it takes much memory to compile.
struct Eigenpairs {
  Eigen::Matrix<std::complex<long double>, -1, 1> values;
  Eigen::Matrix<std::complex<long double>, -1, -1> vectors;
};
Eigenpairs eigenpairs(const Eigen::Matrix<long double, -1, -1>& a);

}  // namespace resonid::plant::test
