// SPDX-License-Identifier: MIT
#include <Eigen/LU>
#include <resonid/online/supervision/detail/loop_errors.hpp>

namespace resonid::online {

TwoMassResponse::Point TwoMassResponse::at(double frequency_hz) const noexcept {
  using Square = Eigen::Matrix3cd;
  const std::complex<double> z = std::polar(1.0, kTwoPi * frequency_hz / sample_rate_hz_);
  Square matrix;
  Eigen::Vector3cd b;
  for (int i = 0; i < 3; ++i) {
    const auto& row = zoh_.ab[static_cast<std::size_t>(i)];
    for (int j = 0; j < 3; ++j) matrix(i, j) = (i == j ? z : 0.0) - row[static_cast<std::size_t>(j)];
    b(i) = row[3];
  }
  const Square inverse = matrix.inverse();
  const Eigen::Vector3cd x = inverse * b;
  Point p;
  p.value = x(0);
  for (std::size_t k = 0; k < kParameters; ++k) {
    std::complex<double> sum = 0.0;
    for (std::size_t i = 0; i < 3; ++i) {
      const auto& row = zoh_.by_log[k][i];
      const auto moved = row[0] * x(0) + row[1] * x(1) + row[2] * x(2) + row[3];
      sum += inverse(0, static_cast<int>(i)) * moved;
    }
    p.relative_gradient[k] = sum / x(0);
  }
  return p;
}

}  // namespace resonid::online
