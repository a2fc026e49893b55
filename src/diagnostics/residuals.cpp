// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::diagnostics {

ResidualTest test_residual(std::span<const double> residual, std::span<const double> simulated,
                           std::size_t max_lag, std::size_t judged_lags) {
  ResidualTest test;
  const std::size_t n = std::min(residual.size(), simulated.size());
  if (n == 0) return test;
  max_lag = std::min(max_lag, n - 1);
  const double mean =
      std::accumulate(simulated.begin(), simulated.begin() + static_cast<std::ptrdiff_t>(n), 0.0) /
      static_cast<double>(n);
  double residual_power = 0.0, simulated_power = 0.0;
  for (std::size_t k = 0; k < n; ++k) {
    residual_power += residual[k] * residual[k];
    simulated_power += (simulated[k] - mean) * (simulated[k] - mean);
  }
  test.limit = 2.17 / std::sqrt(static_cast<double>(n));
  for (std::size_t lag = 0; lag <= max_lag; ++lag) {
    double self = 0.0, cross = 0.0;
    for (std::size_t k = lag; k < n; ++k) {
      self += residual[k] * residual[k - lag];
      cross += residual[k] * (simulated[k - lag] - mean);
    }
    test.autocorrelation.push_back(residual_power > 0.0 ? self / residual_power : 0.0);
    if (lag == 0) continue;
    const double scale = std::sqrt(residual_power * simulated_power);
    test.cross_correlation.push_back(scale > 0.0 ? cross / scale : 0.0);
    if (lag <= judged_lags)
      test.cross_correlation_max =
          std::max(test.cross_correlation_max, std::abs(test.cross_correlation.back()));
  }
  return test;
}

}  // namespace resonid::diagnostics
