// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/constancy.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

/// What a group of stretches says of one parameter.
struct Said {
  double information = 0.0, score = 0.0, squares = 0.0, samples = 0.0;
  void add(const Said& o) {
    information += o.information;
    score += o.score;
    squares += o.squares;
    samples += o.samples;
  }
  [[nodiscard]] double variance() const { return squares / std::max(1.0, samples); }
};

std::vector<Said> grouped(const std::vector<Said>& stretches, const Said& all, int groups) {
  std::vector<Said> sums(static_cast<std::size_t>(groups));
  double before = 0.0;
  for (const auto& s : stretches) {
    const double middle = (before + 0.5 * s.information) / all.information;
    const auto at = static_cast<std::size_t>(middle * groups);
    sums[std::min(at, sums.size() - 1)].add(s);
    before += s.information;
  }
  return sums;
}

Constancy judged(const std::vector<Said>& stretches) {
  Said all;
  for (const auto& s : stretches) all.add(s);
  Constancy c;
  if (!(all.information > 0.0) || !(all.squares > 0.0)) return c;
  for (const int groups : {2, 4, 8}) {
    const auto sums = grouped(stretches, all, groups);
    double chi_square = 0.0, scatter = 0.0;
    std::size_t filled = 0;
    for (const auto& s : sums) {
      // A sweep passes a resonance in one stretch: nothing to be compared then.
      if (!(s.information > 0.01 * all.information)) continue;
      const double step = s.score / s.information - all.score / all.information;
      const double square = step * step * s.information / s.variance();
      chi_square += square;
      scatter += step * step * s.information - s.variance() * (1.0 - s.information / all.information);
      ++filled;
    }
    if (filled < 2) continue;
    const double probability = 3.0 * chi_square_tail(chi_square, filled - 1);
    if (probability < c.probability) c.probability = probability;
    c.scatter = std::sqrt(std::max(0.0, scatter / all.information));
  }
  return c;
}

/// Score test of band-passed slopes as instruments. J* are the slopes of one parameter, the others taken out;
/// Z = F_b J* for causal filters F_b that add up to 1, differences of low-passes an octave apart. The filters
/// look back only, so that noise which a controller feeds back into the slopes does not correlate with the
/// residual.
Constancy judged_by_bands(const Eigen::MatrixXd& slopes, const linalg::Llt& fisher,
                          const Eigen::VectorXd& own, const Eigen::VectorXd& residual) {
  constexpr int kBands = 10;
  const Eigen::Index n = own.size();
  Eigen::MatrixXd bands(n, kBands);
  Eigen::VectorXd above = own;
  for (int b = 0; b + 1 < kBands; ++b) {
    const double pole = std::exp(-kPi / static_cast<double>(2 << b));
    double low = 0.0;
    for (Eigen::Index k = 0; k < n; ++k) {
      low += (1.0 - pole) * (own(k) - low);
      bands(k, b) = above(k) - low;
      above(k) = low;
    }
  }
  bands.col(kBands - 1) = above;
  const double variance = residual.squaredNorm() / static_cast<double>(n), all = own.squaredNorm();
  const Eigen::MatrixXd across = slopes.transpose() * bands;
  const Eigen::VectorXd gradient = slopes.transpose() * residual;  // none at the exact minimum
  const Eigen::VectorXd information = bands.transpose() * own;
  const Eigen::VectorXd score = across.transpose() * fisher.solve(gradient) - bands.transpose() * residual;
  const Eigen::MatrixXd covariance =
      variance * (bands.transpose() * bands - across.transpose() * fisher.solve(across));
  Constancy c;
  if (!(all > 0.0) || !(variance > 0.0)) return c;
  const auto axes = linalg::symmetric_eigenpairs(0.5 * (covariance + covariance.transpose()));
  const Eigen::VectorXd pull = axes.vectors.transpose() * score;
  double chi_square = 0.0, scatter = 0.0;
  std::size_t degrees = 0;
  for (int b = 0; b < kBands; ++b) {
    if (axes.values(b) > 1e-6 * variance * all) {
      chi_square += pull(b) * pull(b) / axes.values(b);
      ++degrees;
    }
    if (information(b) > 0.01 * all) scatter += (score(b) * score(b) - covariance(b, b)) / information(b);
  }
  if (degrees > 0) c.probability = chi_square_tail(chi_square, degrees);
  c.scatter = std::sqrt(std::max(0.0, scatter / all));
  c.over_frequency = true;
  return c;
}

/// Fisher information of scaled slopes, and the direction of one parameter with the others taken out.
struct Directions {
  Eigen::VectorXd scale;
  linalg::Llt whole;
  explicit Directions(const Eigen::MatrixXd& fisher)
      : scale(fisher.diagonal().cwiseSqrt().cwiseInverse()),
        whole(Eigen::MatrixXd(scale.asDiagonal() * fisher * scale.asDiagonal())) {}
  [[nodiscard]] bool usable() const { return scale.allFinite() && whole.succeeded(); }
  [[nodiscard]] Eigen::VectorXd of(Eigen::Index parameter) const {
    // The inverse's column is the direction up to its size.
    const Eigen::VectorXd column =
        whole.solve(Eigen::VectorXd(Eigen::VectorXd::Unit(scale.size(), parameter)));
    const Eigen::VectorXd direction = scale.asDiagonal() * column;
    return direction / direction(parameter);
  }
};

}  // namespace

std::size_t stretches_of(std::size_t samples) {
  constexpr std::size_t kMost = 64, kFewest = 16, kLength = 32;
  const std::size_t stretches = std::min(kMost, samples / kLength);
  return stretches < kFewest ? 0 : stretches;
}

std::vector<Constancy> constancy_over_frequency(const Eigen::MatrixXd& rows, std::span<const int> names) {
  const Eigen::Index columns = rows.cols() - 1;
  const Eigen::MatrixXd raw = rows.leftCols(columns);
  const Directions directions(raw.transpose() * raw);
  if (!directions.usable()) return {};
  const Eigen::MatrixXd slopes = raw * directions.scale.asDiagonal();
  std::vector<Constancy> found;
  for (std::size_t k = 0; k < names.size(); ++k) {
    auto c = judged_by_bands(slopes, directions.whole, raw * directions.of(static_cast<Eigen::Index>(k)),
                             rows.col(columns));
    c.parameter = names[k];
    found.push_back(c);
  }
  return found;
}

std::vector<Constancy> constancy_of(std::span<const StretchFactor> stretches, std::span<const int> names) {
  const Eigen::Index columns = stretches.front().factor.cols() - 1;
  Eigen::MatrixXd fisher = Eigen::MatrixXd::Zero(columns, columns);
  for (const auto& s : stretches)
    fisher += s.factor.leftCols(columns).transpose() * s.factor.leftCols(columns);
  const Directions directions(fisher);  // coordinates differ by many orders
  if (!directions.usable()) return {};
  std::vector<Constancy> found;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const Eigen::VectorXd w = directions.of(static_cast<Eigen::Index>(k));
    std::vector<Said> said;
    for (const auto& s : stretches) {
      const Eigen::VectorXd slope = s.factor.leftCols(columns) * w;
      const auto residual = s.factor.col(columns);
      said.push_back({slope.squaredNorm(), -slope.dot(residual), residual.squaredNorm(),
                      static_cast<double>(s.samples)});
    }
    auto c = judged(said);
    c.parameter = names[k];
    found.push_back(c);
  }
  return found;
}

}  // namespace resonid::fit::detail
