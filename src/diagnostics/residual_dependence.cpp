// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/detail/residual_dependence.hpp>
#include <resonid/fit/detail/noise_model.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::diagnostics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kSamplesPerUnknown = 4;
constexpr double kRank = 1e-10;  // of the largest eigenvalue

std::size_t noise_order(std::size_t samples) { return std::min<std::size_t>(32, samples / 20); }

/// The lags `first` ... `last` of a signal as columns; rows begin at sample `skip`.
MatrixXd lagged(std::span<const double> x, std::size_t first, std::size_t last, std::size_t skip) {
  const auto rows = static_cast<Index>(x.size() - skip);
  MatrixXd columns(rows, static_cast<Index>(last - first + 1));
  for (std::size_t lag = first; lag <= last; ++lag)
    columns.col(static_cast<Index>(lag - first)) = Eigen::Map<const VectorXd>(x.data() + (skip - lag), rows);
  return columns;
}

/// The same, filtered by the noise model; rows begin at sample order + `skip`.
MatrixXd whitened_lags(std::span<const double> x, const fit::NoiseModel& noise, std::size_t first,
                       std::size_t last, std::size_t skip) {
  return lagged(fit::whiten(x, noise), first, last, skip);
}

void centre(MatrixXd& columns) {
  for (Index j = 0; j < columns.cols(); ++j) columns.col(j).array() -= columns.col(j).mean();
}

/// W with W^T (X^T X) W = I over the directions that X has.
MatrixXd inverse_root(const MatrixXd& gram) {
  const VectorXd scale = gram.diagonal().cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const auto axes = linalg::symmetric_eigenpairs(scale.asDiagonal() * gram * scale.asDiagonal());
  const double limit = kRank * std::max(0.0, axes.values(gram.rows() - 1));
  Index kept = 0;
  for (Index i = 0; i < gram.rows(); ++i)
    if (axes.values(i) > limit) ++kept;
  return scale.asDiagonal() * axes.vectors.rightCols(kept) *
         axes.values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

/// Chance of a sum of squares T over sigma^2, sigma^2 from `freedom` other degrees: Bartlett's correction of
/// the likelihood ratio.
double chance(double statistic, std::size_t degrees, double freedom) {
  const double corrected =
      (freedom + 0.5 * static_cast<double>(degrees) - 1.0) * std::log1p(statistic / freedom);
  return chi_square_tail(corrected, degrees);
}

}  // namespace

ResidualDependence residual_dependence(std::span<const double> residual, std::span<const double> signal,
                                       std::size_t lags, const MatrixXd& uncertainty) {
  ResidualDependence d;
  const std::size_t n = residual.size();
  if (n < 2 * noise_order(n) + (kSamplesPerUnknown + 1) * lags || lags == 0 || signal.size() != n) return d;
  const auto noise = fit::fit_noise_model(residual, noise_order(n));
  MatrixXd x = lagged(signal.subspan(noise.order()), 1, lags, lags);
  MatrixXd e = whitened_lags(residual, noise, 0, 0, lags);
  centre(x);
  centre(e);
  const MatrixXd to_basis = inverse_root(x.transpose() * x);
  const auto degrees = static_cast<std::size_t>(to_basis.cols());
  const VectorXd s = to_basis.transpose() * (x.transpose() * e);
  const double total = e.squaredNorm(), freedom = static_cast<double>(e.rows() - to_basis.cols() - 1);
  const double variance = (total - s.squaredNorm()) / freedom;
  d.lags = lags;
  if (degrees == 0 || !(variance > 0.0)) return d;
  MatrixXd covariance = MatrixXd::Identity(s.size(), s.size());
  for (Index j = 0; j < uncertainty.cols(); ++j) {
    const std::span<const double> moved(uncertainty.col(j).data(), n);
    MatrixXd p = whitened_lags(moved, noise, 0, 0, lags);
    centre(p);
    const VectorXd k = to_basis.transpose() * (x.transpose() * p);
    covariance += k * k.transpose() / variance;
  }
  d.probability = chance(s.dot(linalg::RealLdlt(covariance).solve(s)) / variance, degrees, freedom);
  d.share = std::max(0.0, (s.squaredNorm() - static_cast<double>(degrees) * variance) / total);
  return d;
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
  const MatrixXd e = whitened_lags(signals.residual, noise, 0, 0, lags);
  MatrixXd linear(e.rows(), static_cast<Index>(2 * (lags + 1) + 2));
  std::vector<double> all(n, 0.0);
  for (const auto& answer : signals.answers)
    for (std::size_t k = 0; k < n; ++k) all[k] += answer[k];
  linear << whitened_lags(signals.input, noise, 0, lags, lags),
      whitened_lags(signals.simulated, noise, 0, lags, lags), whitened_lags(all, noise, 0, 0, lags),
      VectorXd::Ones(e.rows());
  MatrixXd steps(e.rows(), b_count);
  for (Index b = 0; b < b_count; ++b)
    steps.col(b) = whitened_lags(signals.answers[static_cast<std::size_t>(b)], noise, 0, 0, lags);
  MatrixXd x = steps * curved;
  VectorXd left = e;
  const MatrixXd basis = inverse_root(linear.transpose() * linear);
  const MatrixXd of_linear = linear * basis;
  x -= of_linear * (of_linear.transpose() * x);
  left -= of_linear * (of_linear.transpose() * left);
  const MatrixXd to_basis = inverse_root(x.transpose() * x);
  if (to_basis.cols() == 0) return map;
  const VectorXd s = to_basis.transpose() * (x.transpose() * left);
  const double freedom = static_cast<double>(e.rows() - of_linear.cols() - to_basis.cols());
  const double variance = (left.squaredNorm() - s.squaredNorm()) / freedom;
  if (!(variance > 0.0)) return map;
  const MatrixXd to_bins = curved * to_basis;
  const VectorXd c = to_bins * s;
  map.level = std::move(level);
  map.mean.assign(c.data(), c.data() + c.size());
  for (Index b = 0; b < b_count; ++b) map.std.push_back(std::sqrt(variance) * to_bins.row(b).norm());
  map.probability = chance(s.squaredNorm() / variance, static_cast<std::size_t>(to_basis.cols()), freedom);
  map.share = std::max(0.0, s.squaredNorm() - static_cast<double>(s.size()) * variance) / e.squaredNorm();
  return map;
}

}  // namespace resonid::diagnostics
