// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/online/excitation/metrics.hpp>

namespace resonid::online {

Metrics measure(std::span<const double> samples) noexcept {
  Metrics metrics;
  double squares = 0.0;
  for (const double x : samples) {
    squares += x * x;
    metrics.peak = std::max(metrics.peak, std::abs(x));
  }
  if (!(squares > 0.0)) return metrics;
  metrics.rms = std::sqrt(squares / static_cast<double>(samples.size()));
  metrics.crest_factor = metrics.peak / metrics.rms;
  return metrics;
}

}  // namespace resonid::online
