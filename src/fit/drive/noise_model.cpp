// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/noise_model.hpp>
#include <type_traits>

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

// Side by side, since a sum alone waits for each of its terms; each in its own order.
std::vector<double> whiten(std::span<const double> signal, const NoiseModel& noise) {
  constexpr std::size_t kSide = 16;
  const std::size_t order = noise.order();
  if (signal.size() <= order) return {};
  std::vector<double> result(signal.size() - order);
  const auto sums_from = [&](std::size_t start, auto count) {
    std::array<double, count> sums{};
    for (std::size_t i = 0; i <= order; ++i) {
      const double weight = noise.polynomial[i];
      const double* past = signal.data() + start + order - i;
      for (std::size_t k = 0; k < count; ++k) sums[k] += weight * past[k];
    }
    std::copy(sums.begin(), sums.end(), result.begin() + static_cast<std::ptrdiff_t>(start));
  };
  std::size_t start = 0;
  for (; start + kSide <= result.size(); start += kSide)
    sums_from(start, std::integral_constant<std::size_t, kSide>());
  for (; start < result.size(); ++start) sums_from(start, std::integral_constant<std::size_t, 1>());
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
