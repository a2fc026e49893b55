// SPDX-License-Identifier: MIT
#pragma once

#include <Eigen/Core>
#include <resonid/base/enum_names.hpp>
#include <string_view>
#include <vector>

namespace resonid::planning {

/// What the power of the lines is to make small; V is the covariance of the parameters in parts of their
/// scale.
enum class Criterion {
  accuracy,  ///< The largest of (predicted deviation / wanted deviation)^2 over the targets: least time.
  d,         ///< det V, the volume of the confidence region.
  a,         ///< trace V, the sum of the relative variances.
  e,         ///< The largest eigenvalue of V (by trace V^8, which is nearly that).
};
inline constexpr EnumName<Criterion> kCriterionNames[] = {
    {Criterion::accuracy, "accuracy"}, {Criterion::d, "d"}, {Criterion::a, "a"}, {Criterion::e, "e"}};
[[nodiscard]] constexpr std::span<const EnumName<Criterion>> enum_names(Criterion) noexcept {
  return kCriterionNames;
}

/// One possible drive: what each line tells about it, and what is wanted of it.
struct DesignModel {
  Eigen::MatrixXcd sensitivity;  ///< [parameter, line], see line_sensitivities().
  Eigen::MatrixXd targets;       ///< [target, parameter]: gradient of the figure over its wanted deviation.
};

struct DesignProblem {
  std::vector<DesignModel> models;  ///< At least one; the criterion is averaged over them.
  Eigen::MatrixXd use;              ///< [limit, line] >= 0: part of the limit that unit power uses up.
  Criterion criterion = Criterion::accuracy;
};

struct PowerDistribution {
  Eigen::VectorXd power;  ///< [line] >= 0; the most used limit is used up exactly.
  Eigen::VectorXd used;   ///< [limit] 0 ... 1.
  /// How far the criterion may be from its best, by duality: best >= (1 - gap) value (D: in the geometric
  /// mean of the variances).
  double gap = 0.0;
  int iterations = 0;
};

/// Powers p_k >= 0 of the lines that minimise the criterion of the Fisher information matrix
///
///   M = sum_k p_k Re( d_k* d_k^T ),   subject to   sum_k use_jk p_k <= 1 for every limit j.
///
/// The problem is convex. Multiplicative algorithm: p_k grows with the ratio of what a line gains, the
/// criterion's slope, to what it costs, the limits' uses weighted by their prices; prices rise where a limit
/// is exceeded; the weights of the targets rise where one lags behind. At the optimum no line has a higher
/// ratio than the lines that are used (equivalence theorem), which bounds the gap. Sources: Fedorov 1972;
/// Silvey, Titterington and Torsney 1978; Goodwin and Payne 1977, ch. 6.
[[nodiscard]] PowerDistribution distribute_power(const DesignProblem& problem);

}  // namespace resonid::planning
