// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <complex>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/residual_dependence.hpp>
#include <resonid/fit/detail/noise_model.hpp>

#include "diagnostics/lag_regression.hpp"
#include "linalg/decompositions.hpp"

namespace resonid::diagnostics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kSamplesPerUnknown = 4;

std::size_t noise_order(std::size_t samples) { return std::min<std::size_t>(32, samples / 20); }

/// Chance of a sum of squares T over sigma^2, sigma^2 from `freedom` other degrees: Bartlett's correction of
/// the likelihood ratio.
double chance(double statistic, std::size_t degrees, double freedom) {
  const double corrected =
      (freedom + 0.5 * static_cast<double>(degrees) - 1.0) * std::log1p(statistic / freedom);
  return chi_square_tail(corrected, degrees);
}

/// Residual on columns that the noise of this sample cannot be in.
ResidualDependence dependence_on(std::span<const LaggedColumns> past, std::span<const double> residual,
                                 const fit::NoiseModel& noise, std::size_t skip,
                                 const ModelUncertainty& uncertainty) {
  ResidualDependence d;
  std::vector<LaggedColumns> columns;
  const Index directions = uncertainty.moved.cols();
  for (Index j = 0; j < directions; ++j)
    columns.push_back({{uncertainty.moved.col(j).data(), residual.size()}, 0, 0, &noise});
  columns.insert(columns.end(), past.begin(), past.end());
  columns.push_back({residual, 0, 0, &noise});
  const MatrixXd all = gram_of(columns, skip);
  const bool fitted_here = uncertainty.fitted_here;
  const auto rest =
      fitted_here ? without_first(all, directions)
                  : PartialGram{all.bottomRightCorner(all.rows() - directions, all.cols() - directions), 0};
  const Index width = rest.gram.rows() - 1;
  const VectorXd scale = all.diagonal().segment(directions, width);
  const MatrixXd to_basis = inverse_root(rest.gram.topLeftCorner(width, width), scale);
  const auto degrees = static_cast<std::size_t>(to_basis.cols());
  const VectorXd s = to_basis.transpose() * rest.gram.topRightCorner(width, 1);
  const double total = rest.gram(width, width),
               freedom = static_cast<double>(residual.size() - skip - rest.rank - degrees) - 1.0;
  const double variance = (total - s.squaredNorm()) / freedom;
  if (degrees == 0 || !(variance > 0.0) || !(freedom > 0.0)) return d;
  MatrixXd covariance = MatrixXd::Identity(s.size(), s.size());
  for (Index j = 0; j < directions && !fitted_here; ++j) {
    const VectorXd k = to_basis.transpose() * all.col(j).segment(directions, width);
    covariance += k * k.transpose() / variance;
  }
  d.probability = chance(s.dot(linalg::RealLdlt(covariance).solve(s)) / variance, degrees, freedom);
  d.share = std::max(0.0, (s.squaredNorm() - static_cast<double>(degrees) * variance) / total);
  return d;
}

/// What of a signal lies around a frequency, and the same a quarter of a period later: averaged twice over
/// 1/(2 half_width) s after demodulation.
std::pair<std::vector<double>, std::vector<double>> demodulated(std::span<const double> signal,
                                                                const LineOfSignal& line) {
  const std::size_t n = signal.size();
  const auto length = std::clamp<std::size_t>(
      static_cast<std::size_t>(line.sample_rate_hz / (2.0 * line.half_width)), 1, n / 2);
  std::vector<std::complex<double>> z(n);
  const double step = -kTwoPi * line.frequency_hz / line.sample_rate_hz, level = mean(signal);
  for (std::size_t k = 0; k < n; ++k)
    z[k] = (signal[k] - level) * std::polar(1.0, step * static_cast<double>(k));
  // Of the past alone, or centred: of samples k - length ... k - 1, then k ... k + length - 1.
  const auto averaged = [&](std::size_t behind) {
    std::vector<std::complex<double>> y(n);
    std::complex<double> sum = 0.0;
    for (std::size_t k = 0; k < n + behind; ++k) {
      if (k < n) sum += z[k];
      if (k >= length) sum -= z[k - length];
      if (k >= behind) y[k - behind] = sum;
    }
    z = std::move(y);
  };
  averaged(0);
  averaged(line.past_alone ? 0 : length - 1);
  std::vector<double> real(n), imaginary(n);
  const std::size_t late = line.past_alone ? 1 : 0;
  for (std::size_t k = late; k < n; ++k) {
    const auto v = z[k - late] * std::polar(1.0, -step * static_cast<double>(k - late));
    real[k] = v.real();
    imaginary[k] = v.imag();
  }
  return {std::move(real), std::move(imaginary)};
}

}  // namespace

ResidualDependence residual_dependence(std::span<const double> residual, std::span<const double> signal,
                                       std::size_t lags, const ModelUncertainty& uncertainty) {
  const std::size_t n = residual.size();
  if (n < 2 * noise_order(n) + (kSamplesPerUnknown + 1) * lags || lags == 0 || signal.size() != n) return {};
  const auto noise = fit::fit_noise_model(residual, noise_order(n));
  const LaggedColumns past{signal, 1, lags, nullptr};
  auto d = dependence_on({&past, 1}, residual, noise, lags + noise.order(), uncertainty);
  d.lags = lags;
  return d;
}

double dependence_at(std::span<const double> residual, std::span<const double> signal,
                     const LineOfSignal& line, const ModelUncertainty& uncertainty) {
  const std::size_t n = residual.size();
  if (signal.size() != n || n < 20 * kSamplesPerUnknown || !(line.half_width > 0.0)) return 1.0;
  const auto noise = fit::fit_noise_model(residual, noise_order(n));
  const auto [real, imaginary] = demodulated(signal, line);
  const LaggedColumns parts[] = {{real, 0, 0, nullptr}, {imaginary, 0, 0, nullptr}};
  return dependence_on(parts, residual, noise, noise.order(), uncertainty).probability;
}

std::vector<std::size_t> bins_of(std::span<const double> over, std::size_t most) {
  std::vector<double> sorted(over.begin(), over.end());
  std::sort(sorted.begin(), sorted.end());
  std::vector<double> levels(sorted);
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  std::vector<double> edges;  // lower ones, of all bins but the first
  for (std::size_t b = 1; b < most && !sorted.empty(); ++b) {
    const double edge = levels.size() <= most ? (b < levels.size() ? levels[b] : levels.back())
                                              : sorted[b * sorted.size() / most];
    if (edge > (edges.empty() ? sorted.front() : edges.back())) edges.push_back(edge);
  }
  std::vector<std::size_t> bins;
  bins.reserve(over.size());
  for (const double v : over)
    bins.push_back(static_cast<std::size_t>(std::upper_bound(edges.begin(), edges.end(), v) - edges.begin()));
  return bins;
}

StaticMap static_map(const StaticMapSignals& signals, std::span<const std::size_t> bins, std::size_t lags) {
  StaticMap map;
  const std::size_t n = signals.residual.size(), count = signals.answers.size();
  const auto unknowns = 2 * lags + 4 + count;
  if (count < 3 || n < 2 * noise_order(n) + kSamplesPerUnknown * unknowns + lags) return map;
  std::vector<double> level(count, 0.0), members(count, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    level[bins[k]] += signals.over[k];
    members[bins[k]] += 1.0;
  }
  for (std::size_t b = 0; b < count; ++b) level[b] /= std::max(1.0, members[b]);

  // Orthonormal basis of what is orthogonal to 1 and to the levels.
  const auto b_count = static_cast<Index>(count);
  MatrixXd line(b_count, 2);
  line.col(0).setOnes();
  line.col(1) = Eigen::Map<const VectorXd>(level.data(), b_count);
  line.col(1).array() -= line.col(1).mean();
  for (Index j = 0; j < 2; ++j) line.col(j) /= std::max(line.col(j).norm(), 1e-300);
  const MatrixXd off_line = MatrixXd::Identity(b_count, b_count) - line * line.transpose();
  const MatrixXd curved = linalg::symmetric_eigenpairs(off_line).vectors.rightCols(b_count - 2);

  const auto noise = fit::fit_noise_model(signals.residual, noise_order(n));
  std::vector<double> all(n, 0.0);
  for (const auto& answer : signals.answers)
    for (std::size_t k = 0; k < n; ++k) all[k] += answer[k];
  const std::size_t first = std::min(signals.first_lag, lags);
  std::vector<LaggedColumns> columns = {
      {signals.input, first, lags, &noise}, {signals.simulated, 0, lags, &noise}, {all, 0, 0, &noise}};
  for (const auto& answer : signals.answers) columns.push_back({answer, 0, 0, &noise});
  columns.push_back({signals.residual, 0, 0, &noise});
  const std::size_t skip = lags + noise.order();
  const MatrixXd gram = gram_of(columns, skip);
  const Index linear = gram.rows() - b_count - 1;
  // Columns: the linear ones, what bends, the residual.
  MatrixXd bent = MatrixXd::Zero(gram.rows(), linear + curved.cols() + 1);
  bent.topLeftCorner(linear, linear).setIdentity();
  bent.block(linear, linear, b_count, curved.cols()) = curved;
  bent(gram.rows() - 1, bent.cols() - 1) = 1.0;
  const MatrixXd turned = bent.transpose() * gram * bent;
  const auto left = without_first(turned, linear);
  const Index width = curved.cols();
  const MatrixXd to_basis =
      inverse_root(left.gram.topLeftCorner(width, width), turned.diagonal().segment(linear, width));
  if (to_basis.cols() == 0) return map;
  const VectorXd s = to_basis.transpose() * left.gram.topRightCorner(width, 1);
  const double freedom =
      static_cast<double>(n - skip - left.rank) - static_cast<double>(to_basis.cols()) - 1.0;
  const double variance = (left.gram(width, width) - s.squaredNorm()) / freedom;
  if (!(variance > 0.0)) return map;
  const MatrixXd to_bins = curved * to_basis;
  const VectorXd c = to_bins * s;
  map.level = std::move(level);
  map.mean.assign(c.data(), c.data() + c.size());
  for (Index b = 0; b < b_count; ++b) map.std.push_back(std::sqrt(variance) * to_bins.row(b).norm());
  map.probability = chance(s.squaredNorm() / variance, static_cast<std::size_t>(to_basis.cols()), freedom);
  map.share = std::max(0.0, s.squaredNorm() - static_cast<double>(s.size()) * variance) /
              gram(gram.rows() - 1, gram.rows() - 1);
  return map;
}

}  // namespace resonid::diagnostics
