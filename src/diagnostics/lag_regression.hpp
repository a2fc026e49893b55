// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <resonid/fit/detail/noise_model.hpp>
#include <span>

namespace resonid::diagnostics {

/// The lags first ... last of a signal, whitened where there is a noise model: last - first + 1 columns of a
/// regression.
struct LaggedColumns {
  std::span<const double> signal;
  std::size_t first = 0, last = 0;
  const fit::NoiseModel* noise = nullptr;
};

/// Products of all columns with one another over the samples `skip` ... of signals of one length, of which
/// the columns' means are taken out. `skip` is at least the largest lag and the noise model's order together.
/// The columns are made block by block and never stand in memory as a whole.
[[nodiscard]] Eigen::MatrixXd gram_of(std::span<const LaggedColumns> columns, std::size_t skip);

/// W with W^T G W = I over the directions that a Gram matrix has; `scale`: diagonal by which it is judged
/// which those are, empty: its own.
[[nodiscard]] Eigen::MatrixXd inverse_root(const Eigen::MatrixXd& gram, const Eigen::VectorXd& scale = {});

/// What is left of the columns from `count` on once the first `count` have explained what they can.
struct PartialGram {
  Eigen::MatrixXd gram;
  std::size_t rank = 0;  ///< Directions taken out.
};
[[nodiscard]] PartialGram without_first(const Eigen::MatrixXd& gram, Eigen::Index count);

}  // namespace resonid::diagnostics
