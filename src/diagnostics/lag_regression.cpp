// SPDX-License-Identifier: MIT
#include "diagnostics/lag_regression.hpp"

#include <algorithm>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::diagnostics {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr std::size_t kBlock = 2048;
constexpr double kRank = 1e-10;  // of the largest eigenvalue

/// Rows `from` ... of one signal's columns; `level`: rough mean of the signal, so that sums do not cancel.
void fill(const LaggedColumns& c, std::size_t from, double level, Eigen::Ref<MatrixXd> block) {
  const std::size_t order = c.noise ? c.noise->order() : 0, rows = static_cast<std::size_t>(block.rows());
  std::vector<double> part(c.signal.begin() + static_cast<std::ptrdiff_t>(from - c.last - order),
                           c.signal.begin() + static_cast<std::ptrdiff_t>(from - c.first + rows));
  for (double& v : part) v -= level;
  if (c.noise) part = fit::whiten(part, *c.noise);
  for (std::size_t lag = c.first; lag <= c.last; ++lag)
    block.col(static_cast<Index>(lag - c.first)) =
        Eigen::Map<const VectorXd>(part.data() + (c.last - lag), block.rows());
}

}  // namespace

MatrixXd gram_of(std::span<const LaggedColumns> columns, std::size_t skip) {
  Index width = 0;
  std::vector<double> level;
  for (const auto& c : columns) {
    width += static_cast<Index>(c.last - c.first + 1);
    level.push_back(c.signal.empty() ? 0.0 : mean(c.signal));
  }
  const std::size_t n = columns.empty() ? 0 : columns.front().signal.size();
  MatrixXd gram = MatrixXd::Zero(width, width), block;
  VectorXd sum = VectorXd::Zero(width);
  for (std::size_t from = skip; from < n; from += kBlock) {
    block.resize(static_cast<Index>(std::min(kBlock, n - from)), width);
    Index at = 0;
    for (std::size_t i = 0; i < columns.size(); ++i) {
      const auto count = static_cast<Index>(columns[i].last - columns[i].first + 1);
      fill(columns[i], from, level[i], block.middleCols(at, count));
      at += count;
    }
    gram.noalias() += block.transpose() * block;
    sum += block.colwise().sum().transpose();
  }
  if (n > skip) gram.noalias() -= sum * sum.transpose() / static_cast<double>(n - skip);
  return gram;
}

MatrixXd inverse_root(const MatrixXd& gram, const VectorXd& diagonal) {
  const VectorXd of = diagonal.size() > 0 ? diagonal : VectorXd(gram.diagonal());
  const VectorXd scale = of.cwiseMax(0.0).cwiseSqrt().cwiseMax(1e-300).cwiseInverse();
  const auto axes = linalg::symmetric_eigenpairs(scale.asDiagonal() * gram * scale.asDiagonal());
  const double limit =
      kRank * std::max(diagonal.size() > 0 ? 1.0 : 0.0, gram.rows() > 0 ? axes.values(gram.rows() - 1) : 0.0);
  Index kept = 0;
  for (Index i = 0; i < gram.rows(); ++i)
    if (axes.values(i) > limit) ++kept;
  return scale.asDiagonal() * axes.vectors.rightCols(kept) *
         axes.values.tail(kept).cwiseSqrt().cwiseInverse().asDiagonal();
}

PartialGram without_first(const MatrixXd& gram, Index count) {
  const Index rest = gram.rows() - count;
  PartialGram p{gram.bottomRightCorner(rest, rest), 0};
  if (count == 0) return p;
  const MatrixXd basis = inverse_root(gram.topLeftCorner(count, count));
  const MatrixXd along = basis.transpose() * gram.topRightCorner(count, rest);
  p.gram.noalias() -= along.transpose() * along;
  p.rank = static_cast<std::size_t>(basis.cols());
  return p;
}

}  // namespace resonid::diagnostics
