// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/noise_model.hpp>

namespace resonid::fit {

NoiseModel fit_noise_model(std::span<const double> residual, std::size_t max_order) {
  const std::size_t n = residual.size();
  NoiseModel best;
  if (n == 0) return best;
  max_order = std::min(max_order, n / 10);
  std::vector<double> forward(residual.begin(), residual.end());
  std::vector<double> backward = forward;
  double variance = mean_square(residual);
  best.innovation_variance = variance;
  if (!(variance > 0.0)) return best;
  const double penalty = std::log(static_cast<double>(n));
  double best_bic = static_cast<double>(n) * std::log(variance);
  std::vector<double> a = {1.0};
  for (std::size_t p = 1; p <= max_order; ++p) {
    double cross = 0.0, power = 0.0;
    for (std::size_t k = p; k < n; ++k) {
      cross += forward[k] * backward[k - 1];
      power += forward[k] * forward[k] + backward[k - 1] * backward[k - 1];
    }
    if (!(power > 0.0)) break;
    const double reflection = -2.0 * cross / power;
    for (std::size_t k = n; k-- > p;) {
      const double f = forward[k];
      forward[k] = f + reflection * backward[k - 1];
      backward[k] = backward[k - 1] + reflection * f;
    }
    std::vector<double> next(p + 1, 0.0);
    for (std::size_t i = 0; i <= p; ++i)
      next[i] = (i < a.size() ? a[i] : 0.0) + reflection * (p - i < a.size() ? a[p - i] : 0.0);
    a = std::move(next);
    variance *= 1.0 - reflection * reflection;
    if (!(variance > 0.0)) break;
    const double bic = static_cast<double>(n) * std::log(variance) + static_cast<double>(p) * penalty;
    if (bic < best_bic) {
      best_bic = bic;
      best.polynomial = a;
      best.innovation_variance = variance;
    }
  }
  return best;
}

std::vector<double> whiten(std::span<const double> signal, const NoiseModel& noise) {
  const std::size_t order = noise.order();
  std::vector<double> result;
  if (signal.size() <= order) return result;
  result.reserve(signal.size() - order);
  for (std::size_t k = order; k < signal.size(); ++k) {
    double sum = 0.0;
    for (std::size_t i = 0; i <= order; ++i) sum += noise.polynomial[i] * signal[k - i];
    result.push_back(sum);
  }
  return result;
}

std::vector<bool> touched(const std::vector<bool>& marked, const NoiseModel& noise) {
  const std::size_t order = noise.order();
  if (marked.size() <= order) return {};
  std::vector<bool> any(marked.size() - order, false);
  for (std::size_t k = 0; k < any.size(); ++k)
    for (std::size_t i = 0; i <= order && !any[k]; ++i)
      any[k] = noise.polynomial[i] != 0.0 && marked[k + order - i];
  return any;
}

}  // namespace resonid::fit
