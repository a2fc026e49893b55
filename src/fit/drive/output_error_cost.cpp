// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/output_error_cost.hpp>

namespace resonid::fit::detail {
namespace {

int rows_of(const OutputErrorCost::Part& part) { return static_cast<int>(part.active.size()) + 1; }

}  // namespace

OutputErrorCost::OutputErrorCost(std::vector<Part> parts, const CoordinateLayout& layout,
                                 const SearchRange& range, int checked)
    : parts_(std::move(parts)), layout_(layout), range_(range), checked_(checked) {
  int rows = 0;
  for (const auto& part : parts_) rows += rows_of(part);
  set_num_residuals(rows);
  mutable_parameter_block_sizes()->push_back(layout.size());
}

bool OutputErrorCost::Evaluate(double const* const* blocks, double* residuals, double** jacobians) const {
  const std::span<const double> x(blocks[0], static_cast<std::size_t>(layout_.size()));
  if (!range_.contains(x.data(), checked_)) return false;
  std::fill(residuals, residuals + num_residuals(), 0.0);
  const bool slopes = jacobians != nullptr && jacobians[0] != nullptr;
  if (slopes) std::fill(jacobians[0], jacobians[0] + num_residuals() * layout_.size(), 0.0);
  int row = 0, record = 0;
  bool finite = true;
  for (const auto& part : parts_) {
    const auto mine = layout_.local(record, x);
    if (!slopes) {
      const double sum = part.simulation.sum_of_squares(mine);
      residuals[row] = part.weight * std::sqrt(sum);
      finite = finite && std::isfinite(sum);
    } else {
      const Eigen::MatrixXd factor = part.weight * part.simulation.factor(mine, part.active);
      finite = finite && factor.allFinite();
      for (Eigen::Index i = 0; i < factor.rows(); ++i) {
        residuals[row + i] = factor(i, factor.cols() - 1);
        for (std::size_t p = 0; p < part.active.size(); ++p)
          jacobians[0][(row + i) * layout_.size() + layout_.of(record, part.active[p])] =
              factor(i, static_cast<Eigen::Index>(p));
      }
    }
    row += rows_of(part);
    ++record;
  }
  return finite;
}

}  // namespace resonid::fit::detail
