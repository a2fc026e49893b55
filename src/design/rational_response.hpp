// SPDX-License-Identifier: MIT
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <resonid/fit/detail/sampled_states.hpp>

namespace resonid::design {

/// Without the checks for infinities that std::complex makes.
[[nodiscard]] inline std::complex<double> plain_product(const std::complex<double>& x,
                                                        const std::complex<double>& y) {
  return {x.real() * y.real() - x.imag() * y.imag(), x.real() * y.imag() + x.imag() * y.real()};
}
[[nodiscard]] inline double square_of(const std::complex<double>& x) {
  return x.real() * x.real() + x.imag() * x.imag();
}

/// A drive's responses as ratios of polynomials in z - 1, by Leverrier's and Faddeev's recursion: a small
/// part of the work of fit::SampledResponse at the same exactness, for those who look at thousands of
/// machines (docs/methods/tune.md 3.2).
class RationalResponse {
 public:
  explicit RationalResponse(const fit::SampledStates& states);

  /// At z - 1.
  [[nodiscard]] fit::SampledResponse::Value at(const std::complex<double>& step) const;

 private:
  static constexpr int kMost = 7;  ///< A grounded drive of three masses with a lagging torque.
  struct Core;
  /// c0 + c1 (z - 1) + ...
  using Polynomial = std::array<double, kMost + 1>;
  [[nodiscard]] std::complex<double> value_of(const Polynomial& p, const std::complex<double>& step) const;

  int order_ = 0, whole_delay_ = 0;
  Polynomial denominator_{}, measured_{}, load_{};
  double past_ = 0.0, pole_ = 0.0;
};

inline std::complex<double> RationalResponse::value_of(const Polynomial& p,
                                                       const std::complex<double>& step) const {
  std::complex<double> sum = p[static_cast<std::size_t>(order_)];
  for (int k = order_ - 1; k >= 0; --k) sum = plain_product(sum, step) + p[static_cast<std::size_t>(k)];
  return sum;
}

inline fit::SampledResponse::Value RationalResponse::at(const std::complex<double>& step) const {
  const auto inverse = [](const std::complex<double>& x) { return std::conj(x) / square_of(x); };
  const std::complex<double> back = std::conj(1.0 + step);  // on the unit circle that is 1/z
  const std::complex<double> one_over = inverse(value_of(denominator_, step));
  std::complex<double> measured = plain_product(value_of(measured_, step), one_over);
  if (past_ != 0.0) measured += past_ * back;
  measured = plain_product(measured, pole_ == 0.0 ? back : inverse(1.0 + step - pole_));
  std::complex<double> power = back;
  for (int n = whole_delay_; n > 0; n >>= 1) {
    if (n & 1) measured = plain_product(measured, power);
    power = plain_product(power, power);
  }
  return {measured, plain_product(value_of(load_, step), one_over)};
}

}  // namespace resonid::design
