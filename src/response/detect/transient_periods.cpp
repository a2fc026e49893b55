// SPDX-License-Identifier: MIT
#include <Eigen/Core>
#include <algorithm>
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
  const Eigen::Index settled = std::max<Eigen::Index>(2, periods.cols() / 2);
  const auto last = periods.rightCols(settled);
  const Eigen::VectorXd mean = last.rowwise().mean();
  // What is less than a thousandth of the motion is of no consequence.
  constexpr double kNoticeable = 1e-3;
  const double most = std::max(kUnsettled * distances(last).maxCoeff(), kNoticeable * mean.norm());
  Eigen::Index first = 0;
  const auto apart = [&](Eigen::Index period) { return (periods.col(period) - mean).norm(); };
  while (first < periods.cols() - settled && apart(first) > most) ++first;
  // A transient decays into what settles. What stays as far from it until it ends is another machine; it may
  // have changed within the last of the periods.
  constexpr double kDecayed = 0.7;
  if (first > 1 && apart(std::max<Eigen::Index>(1, first - 2)) > kDecayed * apart(0)) return 0;
  return static_cast<std::size_t>(first);
}

}  // namespace resonid::response
