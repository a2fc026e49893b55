// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/fit/output_error.hpp>
#include <span>
#include <vector>

namespace resonid::fit::detail {

/// Samples beyond which rows are not kept.
inline constexpr std::size_t kLongRecord = 300'000;

/// Stretches of a record that are compared: at most 64, of 32 samples or more; 0: too few for that.
[[nodiscard]] std::size_t stretches_of(std::size_t samples);

/// One stretch of a record at the estimate: triangular factor of [J r] of the active coordinates, and its
/// length.
struct StretchFactor {
  Eigen::MatrixXd factor;
  std::size_t samples = 0;
};

/// The same of bands of frequency in the place of stretches, from [J r] sample by sample: a model that lacks
/// something explains each band by other parameters. With band-passed slopes Z as instruments, r being
/// orthogonal to J,
///
///   (Z'r)' [v (Z'Z - Z'J (J'J)^-1 J'Z)]^-1 (Z'r)  ~  chi square.
[[nodiscard]] std::vector<Constancy> constancy_over_frequency(const Eigen::MatrixXd& rows,
                                                              std::span<const int> names);

/// Tests of the first `names.size()` active coordinates. With the others taken out over the whole record,
/// w = (1, -beta), a stretch s contributes the information I_s = w' J_s' J_s w and the score g_s = w' J_s'
/// r_s. In 2, 4 and 8 groups of equal information the scores of a constant parameter are independent,
///
///   sum over groups of (g - I/sum(I) sum(g))^2 / (v I)  ~  chi square of (groups - 1) degrees,
///
/// v being the group's own mean squared residual (a score test as of Rao 1948, in the place of Nyblom 1989,
/// whose sums take the information for evenly spread). The least of the three probabilities counts, times
/// three.
[[nodiscard]] std::vector<Constancy> constancy_of(std::span<const StretchFactor> stretches,
                                                  std::span<const int> names);

}  // namespace resonid::fit::detail
