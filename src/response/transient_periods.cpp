// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <resonid/response/periodic_averaging.hpp>

namespace resonid::response {
namespace {

/// [sample of the period, period] of the output, differences of a position.
Eigen::MatrixXd periods_of(const data::Record& record, std::size_t period) {
  const auto& y = record.output.samples;
  const bool position = record.output_quantity == data::OutputQuantity::position;
  const auto count = static_cast<Eigen::Index>(y.size() / period);
  const auto rows = static_cast<Eigen::Index>(position ? period - 1 : period);
  Eigen::MatrixXd periods(rows, count);
  for (Eigen::Index p = 0; p < count; ++p)
    for (Eigen::Index k = 0; k < rows; ++k) {
      const auto at = static_cast<std::size_t>(p) * period + static_cast<std::size_t>(k);
      periods(k, p) = position ? y[at + 1] - y[at] : y[at];
    }
  periods.rowwise() -= periods.colwise().mean().eval();
  return periods;
}

/// Distance of each of the periods from the mean of the others.
Eigen::VectorXd distances(const Eigen::Ref<const Eigen::MatrixXd>& periods) {
  const auto others = static_cast<double>(periods.cols() - 1);
  const Eigen::VectorXd sum = periods.rowwise().sum();
  return ((periods * (1.0 + 1.0 / others)).colwise() - sum / others).colwise().norm();
}

}  // namespace

std::size_t transient_periods(const data::Record& record, std::size_t period_samples) {
  constexpr double kUnsettled = 2.0;
  if (record.samples() < 3 * period_samples) return 0;
  const auto periods = periods_of(record, period_samples);
  Eigen::Index first = 0;
  for (; first + 2 < periods.cols(); ++first) {
    const Eigen::Index later = periods.cols() - first - 1;
    const double own = distances(periods.rightCols(later + 1))(0);
    if (!(own > kUnsettled * distances(periods.rightCols(later)).maxCoeff())) break;
  }
  return static_cast<std::size_t>(first);
}

}  // namespace resonid::response
