// SPDX-License-Identifier: MIT
#include <fit/drive/record_consistency.hpp>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {

std::vector<Consistency> against_others(const std::vector<RecordScore>& records) {
  Eigen::MatrixXd fisher = records.front().fisher_information;
  Eigen::VectorXd gradient = records.front().gradient;
  for (std::size_t i = 1; i < records.size(); ++i) {
    fisher += records[i].fisher_information;
    gradient += records[i].gradient;
  }
  const linalg::Llt whole(fisher);
  if (!whole.succeeded() || !fisher.allFinite()) return {};
  const Eigen::MatrixXd lower = whole.lower();
  std::vector<Consistency> list;
  for (const auto& r : records) {
    // In coordinates in which all together have unit information, this record's part of it is 0 ... 1.
    const Eigen::MatrixXd half = linalg::solve_lower(lower, r.fisher_information);
    const Eigen::MatrixXd part = linalg::solve_lower(lower, half.transpose());
    const auto axes = linalg::symmetric_eigenpairs(0.5 * (part + part.transpose()));
    const Eigen::VectorXd left = r.gradient - r.fisher_information * whole.solve(gradient);
    const Eigen::VectorXd pull = axes.vectors.transpose() * linalg::solve_lower(lower, left);
    Consistency c;
    constexpr double kLeastPart = 1e-3;
    for (Eigen::Index k = 0; k < pull.size(); ++k) {
      const double share = axes.values(k);
      if (share < kLeastPart || share > 1.0 - kLeastPart) continue;
      c.chi_square += pull(k) * pull(k) / (share * (1.0 - share));
      ++c.degrees;
    }
    if (c.degrees > 0) c.probability = chi_square_tail(c.chi_square, static_cast<std::size_t>(c.degrees));
    list.push_back(c);
  }
  return list;
}

}  // namespace resonid::fit::detail
