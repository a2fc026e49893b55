// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/linear_simulation.hpp>
#include <resonid/diagnostics/gap.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::identification::detail {

LinearSimulation simulate_nearest(const data::TransferFunction& g, std::span<const double> input,
                                  std::span<const double> measured, bool constant) {
  LinearSimulation result;
  result.output = g.simulate(input);
  const auto n = static_cast<Eigen::Index>(measured.size());
  std::vector<std::vector<double>> columns;
  columns.push_back(g.simulate(std::vector<double>(measured.size(), 1.0)));
  const data::TransferFunction free{{1.0}, g.denominator, g.sample_time_s};
  std::vector<double> impulse(measured.size(), 0.0);
  for (std::size_t i = 0; i + 1 < g.denominator.size() && i < impulse.size(); ++i) {
    impulse.assign(impulse.size(), 0.0);
    impulse[i] = 1.0;
    columns.push_back(free.simulate(impulse));
  }
  if (constant) columns.emplace_back(measured.size(), 1.0);
  Eigen::MatrixXd basis(n, static_cast<Eigen::Index>(columns.size()));
  Eigen::VectorXd scale(basis.cols());
  for (Eigen::Index j = 0; j < basis.cols(); ++j) {
    basis.col(j) = Eigen::Map<const Eigen::VectorXd>(columns[static_cast<std::size_t>(j)].data(), n);
    scale(j) = std::max(basis.col(j).norm(), 1e-300);
    basis.col(j) /= scale(j);
  }
  Eigen::VectorXd left(n);
  for (Eigen::Index k = 0; k < n; ++k)
    left(k) = measured[static_cast<std::size_t>(k)] - result.output[static_cast<std::size_t>(k)];
  const linalg::PivotedQr qr(basis);
  const Eigen::VectorXd weights = qr.solve(left);
  const Eigen::VectorXd correction = basis * weights;
  for (Eigen::Index k = 0; k < n; ++k) result.output[static_cast<std::size_t>(k)] += correction(k);
  // In closed loop with an integrating controller a constant torque leaves no trace to tell it by.
  if (!constant && qr.rank() == basis.cols()) {
    const Eigen::MatrixXd normal = linalg::inverse(basis.transpose() * basis);
    const double variance =
        (left - correction).squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, n - basis.cols()));
    result.offset =
        data::Estimate{weights(0) / scale(0), std::sqrt(std::max(0.0, variance * normal(0, 0))) / scale(0)};
  }
  return result;
}

data::TransferFunction delayed(data::TransferFunction g, std::size_t samples) {
  g.numerator.insert(g.numerator.begin(), samples, 0.0);
  return g;
}

data::TransferFunction closed_loop(const data::TransferFunction& g,
                                   const data::TransferFunction& controller) {
  const auto loop = diagnostics::weighted(controller, g);
  auto denominator = loop.denominator;
  denominator.resize(std::max(denominator.size(), loop.numerator.size()), 0.0);
  for (std::size_t i = 0; i < loop.numerator.size(); ++i) denominator[i] += loop.numerator[i];
  const data::TransferFunction through{controller.denominator, {1.0}, g.sample_time_s};
  return {diagnostics::weighted(through, {g.numerator, {1.0}, g.sample_time_s}).numerator, denominator,
          g.sample_time_s};
}

double largest_pole(const data::TransferFunction& g) {
  double largest = 0.0;
  for (const auto& pole : g.poles()) largest = std::max(largest, std::abs(pole));
  return largest;
}

bool can_be_simulated(const data::TransferFunction& g, std::size_t samples) {
  constexpr double kMostGrowth = 3.0;  // ln 20
  return static_cast<double>(samples) * std::log(largest_pole(g)) <= kMostGrowth;
}

}  // namespace resonid::identification::detail
