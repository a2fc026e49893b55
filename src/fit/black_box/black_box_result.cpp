// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/black_box_result.hpp>
#include <resonid/base/detail/statistics.hpp>

namespace resonid::fit::detail {
namespace {

bool unstable(const UncertainRoot& pole) {
  constexpr double kRounding = 1e-9, kStandardDeviations = 3.0;
  if (std::abs(pole.value) <= 1.0 + kRounding) return false;
  const std::complex<double> left = pole.value - 1.0;
  const double distance = std::abs(left);
  const Eigen::Vector2d along(left.real() / distance, left.imag() / distance);
  const double variance = along.dot(pole.covariance * along);
  return !(distance <= kStandardDeviations * std::sqrt(std::max(0.0, variance)));
}

}  // namespace

BlackBoxModel model_of(const BlackBoxState& state, const BlackBoxLayout& layout, const BlackBoxConfig& config,
                       const Eigen::MatrixXd& covariance) {
  const auto n = layout.order, m = layout.taps;
  BlackBoxModel model;
  model.delay_samples = config.delay_samples;
  model.known_delay_s = config.known_delay_s;
  model.realisation = {state.basis.transition, state.basis.input, state.weights, state.taps,
                       layout.integrator,      covariance};

  const auto p = polynomials(state.basis);
  // Columns: coefficients of z^-0 ... of numerator and denominator per [alpha, c, h].
  const auto order = static_cast<Eigen::Index>(config.order);
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(order + 1, 2 * n + m);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(order + 1, 2 * n + m);
  const Eigen::Index late = layout.integrator && m == 1 ? 1 : 0;
  for (Eigen::Index i = 0; i < n; ++i) {
    b.col(n + i).segment(1 + late + (m == 2 ? 1 : 0), n) = p.numerators.col(i);
    a.col(i).segment(1, n) = p.numerators.col(i);
  }
  for (Eigen::Index t = 0; t < m; ++t) b.col(2 * n + t).segment(late + t, n + 1) = p.denominator;
  Eigen::VectorXd parameters(2 * n + m);
  parameters << Eigen::VectorXd::Zero(n), state.weights, state.taps;
  const Eigen::VectorXd numerator = b * parameters;
  Eigen::VectorXd denominator = Eigen::VectorXd::Zero(order + 1);
  denominator.head(n + 1) = p.denominator;
  if (layout.integrator) {
    for (Eigen::Index i = order; i > 0; --i) {
      denominator(i) -= denominator(i - 1);
      a.row(i) -= a.row(i - 1).eval();
    }
  }
  model.transfer_function.numerator.assign(numerator.begin(), numerator.end());
  model.transfer_function.denominator.assign(denominator.begin(), denominator.end());
  Eigen::MatrixXd both(2 * order + 1, 2 * n + m);
  both << b, a.bottomRows(order);
  model.covariance = both * covariance * both.transpose();
  return model;
}

bool is_stable(const BlackBoxModel& model) {
  const auto poles = model.poles();
  return std::none_of(poles.begin(), poles.end(), unstable);
}

double fit_percent(const std::vector<double>& output, const std::vector<double>& residual,
                   const std::vector<bool>& marked) {
  const std::size_t first = output.size() - residual.size();
  double count = 0.0, sum = 0.0, total = 0.0, left = 0.0;
  for (std::size_t k = first; k < output.size(); ++k)
    if (!marked[k]) sum += output[k], count += 1.0;
  for (std::size_t k = first; k < output.size(); ++k) {
    if (marked[k]) continue;
    total += std::pow(output[k] - sum / count, 2);
    left += std::pow(residual[k - first], 2);
  }
  return fit_percent_of(left, total);
}

}  // namespace resonid::fit::detail
