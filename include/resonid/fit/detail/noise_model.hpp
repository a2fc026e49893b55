// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace resonid::fit {

/// Autoregressive model of a residual: sum_i a_i e(k-i) = white, a_0 = 1.
struct NoiseModel {
  std::vector<double> polynomial = {
      1.0};                          ///< a_0 ... a_p in powers of z^-1; all roots inside the unit circle.
  double innovation_variance = 0.0;  ///< Variance of the white noise that drives it.

  [[nodiscard]] std::size_t order() const noexcept { return polynomial.size() - 1; }
};

/// As many orders as fits of a drive try. What a loop has shaped needs that many: with 32 the error bars of
/// such fits come out 10 % small.
inline constexpr std::size_t kHighestNoiseOrder = 64;

/// Burg's method with the order chosen by the Bayesian information criterion among 0 ... max_order. White
/// residuals come out as order 0.
[[nodiscard]] NoiseModel fit_noise_model(std::span<const double> residual, std::size_t max_order);

/// The signal filtered by the polynomial; the first order() samples, which would need the past, are left out.
[[nodiscard]] std::vector<double> whiten(std::span<const double> signal, const NoiseModel& noise);

/// [sample of the whitened signal] Whether any of the samples that it is made of is marked.
[[nodiscard]] std::vector<bool> touched(const std::vector<bool>& marked, const NoiseModel& noise);

}  // namespace resonid::fit
