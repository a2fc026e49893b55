// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <numeric>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::diagnostics {
namespace {

double mean_of(std::span<const double> x) { return x.empty() ? 0.0 : mean(x); }

std::vector<double> centred(std::span<const double> x) {
  std::vector<double> out(x.begin(), x.end());
  const double mean = mean_of(x);
  for (double& v : out) v -= mean;
  return out;
}

/// sum a(k) b(k - lag), lag >= 0
double product(const std::vector<double>& a, const std::vector<double>& b, std::size_t lag) {
  return std::inner_product(a.begin() + static_cast<std::ptrdiff_t>(lag), a.end(), b.begin(), 0.0);
}

/// Variance of a correlation of two independent coloured signals over that of white ones,
/// sum_t Ree(t) Rxx(t): Bartlett's formula. Lags beyond M are taken for 0.
double bartlett(const std::vector<double>& e, const std::vector<double>& x, std::size_t max_lag) {
  const double scale = sum_of_squares(e) * sum_of_squares(x);
  double sum = 1.0;
  for (std::size_t lag = 1; lag <= max_lag && scale > 0.0; ++lag)
    sum += 2.0 * product(e, e, lag) * product(x, x, lag) / scale;
  return std::max(1.0, sum);
}

ResidualCorrelation correlate(const std::vector<double>& e, const std::vector<double>& x,
                              const ResidualTest& test, bool itself) {
  ResidualCorrelation c;
  const double scale = std::sqrt(sum_of_squares(e) * sum_of_squares(x));
  const auto normalised = [&](double sum) { return scale > 0.0 ? sum / scale : 0.0; };
  c.value.resize(2 * test.max_lag + 1);
  for (std::size_t lag = 0; lag <= test.max_lag; ++lag) {
    c.value[test.max_lag + lag] = normalised(product(e, x, lag));
    c.value[test.max_lag - lag] = normalised(product(x, e, lag));
  }
  if (!itself) c.colour = std::sqrt(bartlett(e, x, test.max_lag));
  for (std::size_t lag = 1; lag <= test.judged_lags; ++lag) {
    const double size = std::abs(c.value[test.max_lag + lag]);
    if (size > test.limit) ++c.beyond;
    if (size <= c.largest) continue;
    c.largest = size;
    c.largest_lag = static_cast<int>(lag);
  }
  return c;
}

}  // namespace

std::vector<double> simulated_of(std::span<const double> output, std::span<const double> residual) {
  const auto same = output.last(residual.size());
  std::vector<double> simulated(same.begin(), same.end());
  for (std::size_t k = 0; k < simulated.size(); ++k) simulated[k] -= residual[k];
  return simulated;
}

ResidualTest test_residual(const ResidualSignals& signals, std::size_t max_lag, std::size_t judged_lags) {
  ResidualTest test;
  std::size_t n = signals.residual.size();
  for (const auto& s : {signals.simulated, signals.input, signals.excitation})
    if (!s.empty()) n = std::min(n, s.size());
  if (n == 0) return test;
  test.samples = n;
  test.max_lag = std::min(max_lag, n - 1);
  test.judged_lags = std::min(judged_lags, test.max_lag);
  test.limit = 2.17 / std::sqrt(static_cast<double>(n));
  const auto e = centred(signals.residual.first(n));
  test.mean = mean_of(signals.residual.first(n));
  test.rms = std::sqrt(sum_of_squares(e) / static_cast<double>(n));
  test.self = correlate(e, e, test, true);
  const auto with = [&](std::span<const double> x) {
    return x.empty() ? ResidualCorrelation{} : correlate(e, centred(x.first(n)), test, false);
  };
  test.with_simulated = with(signals.simulated);
  test.with_input = with(signals.input);
  test.with_excitation = with(signals.excitation);
  if (!signals.simulated.empty() && test.rms > 0.0)
    test.snr_db = 10.0 * std::log10(sum_of_squares(centred(signals.simulated.first(n))) / sum_of_squares(e));
  return test;
}

}  // namespace resonid::diagnostics
