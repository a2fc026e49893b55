// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/constancy.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <unsupported/Eigen/FFT>

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
    double first = 0.0, last = 0.0;
    for (const auto& s : sums) {
      // A sweep passes a resonance in one stretch: nothing to be compared then.
      if (!(s.information > 0.01 * all.information)) continue;
      const double step = s.score / s.information - all.score / all.information;
      const double square = step * step * s.information / s.variance();
      chi_square += square;
      scatter += step * step * s.information - s.variance() * (1.0 - s.information / all.information);
      if (filled++ == 0) first = step;
      last = step;
    }
    if (filled < 2) continue;
    const double probability = 3.0 * chi_square_tail(chi_square, filled - 1);
    if (probability < c.probability) c.probability = probability;
    c.scatter = std::sqrt(std::max(0.0, scatter / all.information));
    c.change = last - first;
  }
  return c;
}

}  // namespace

std::vector<StretchFactor> bands_of(const Eigen::MatrixXd& rows) {
  Eigen::Index length = 1;  // a power of two: zeros behind the record only interpolate its spectrum ...
  while (length < rows.rows()) length *= 2;
  const double independent =
      static_cast<double>(rows.rows()) / static_cast<double>(length);  // ... of so many lines
  Eigen::FFT<double> fft(Eigen::default_fft_impl<double>(), Eigen::FFT<double>::HalfSpectrum);
  const Eigen::Index bins = length / 2;
  Eigen::MatrixXd spectrum(2 * bins, rows.cols());
  std::vector<double> padded(static_cast<std::size_t>(length));
  std::vector<std::complex<double>> transformed;
  for (Eigen::Index c = 0; c < rows.cols(); ++c) {
    std::fill(padded.begin(), padded.end(), 0.0);
    for (Eigen::Index k = 0; k < rows.rows(); ++k) padded[static_cast<std::size_t>(k)] = rows(k, c);
    fft.fwd(transformed, padded);
    const double scale = std::sqrt(2.0 / static_cast<double>(length));
    for (Eigen::Index b = 0; b < bins; ++b) {
      spectrum(2 * b, c) = scale * transformed[static_cast<std::size_t>(b)].real();
      spectrum(2 * b + 1, c) = scale * transformed[static_cast<std::size_t>(b)].imag();
    }
  }
  std::vector<StretchFactor> found;
  constexpr Eigen::Index kBands = 1024;
  const Eigen::Index width = std::max<Eigen::Index>(4, bins / kBands);
  for (Eigen::Index b = 0; b < bins; b += width) {
    const Eigen::Index count = std::min(width, bins - b);
    found.push_back({spectrum.middleRows(2 * b, 2 * count),
                     static_cast<std::size_t>(std::lround(2.0 * independent * static_cast<double>(count)))});
  }
  return found;
}

std::vector<Constancy> constancy_of(std::span<const StretchFactor> stretches, std::span<const int> names) {
  const Eigen::Index columns = stretches.front().factor.cols() - 1;
  Eigen::MatrixXd fisher = Eigen::MatrixXd::Zero(columns, columns);
  for (const auto& s : stretches)
    fisher += s.factor.leftCols(columns).transpose() * s.factor.leftCols(columns);
  // Coordinates differ by many orders.
  const Eigen::VectorXd scale = fisher.diagonal().cwiseSqrt().cwiseInverse();
  if (!scale.allFinite()) return {};
  fisher = scale.asDiagonal() * fisher * scale.asDiagonal();
  const linalg::Llt whole(fisher);
  if (!whole.succeeded()) return {};
  std::vector<Constancy> found;
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    // The inverse's column is w up to its size.
    Eigen::VectorXd w = whole.solve(Eigen::VectorXd(Eigen::VectorXd::Unit(columns, at)));
    w /= w(at);
    w = scale.asDiagonal() * w;
    const double unit = w(at);
    std::vector<Said> said;
    for (const auto& s : stretches) {
      const Eigen::VectorXd slope = s.factor.leftCols(columns) * w / unit;
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
