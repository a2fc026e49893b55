// SPDX-License-Identifier: MIT
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace resonid::diagnostics {

/// Normalised correlations of a residual (METHOD 9).
struct ResidualTest {
  std::vector<double> autocorrelation;    ///< [lag 0 ... M], 1 at lag 0.
  std::vector<double> cross_correlation;  ///< [lag 1 ... M] with the simulated output.
  double cross_correlation_max = 0.0;     ///< Largest magnitude over the judged lags.
  double limit = 0.0;  ///< 2.17/sqrt(N): 3 % per lag; even the true model fails it at high SNR.
};

/// `RN(t) = sum e(k) yh(k-t) / sqrt(sum e^2 sum yh^2)` for lags 1 ... max_lag; the verdict counts 1 ...
/// judged_lags.
[[nodiscard]] ResidualTest test_residual(std::span<const double> residual, std::span<const double> simulated,
                                         std::size_t max_lag, std::size_t judged_lags);

}  // namespace resonid::diagnostics
