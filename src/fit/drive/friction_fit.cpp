// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/friction_fit.hpp>
#include <limits>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {

std::vector<double> FrictionProblem::local(const FrictionRecord& record, const std::vector<double>& x) const {
  std::vector<double> mine;
  for (const int place : record.coordinates) mine.push_back(x[static_cast<std::size_t>(place)]);
  return mine;
}

Eigen::VectorXd FrictionProblem::residual(const FrictionRecord& record, const std::vector<double>& x) const {
  std::optional<DriveSignals> all;  // the noise model needs neighbours
  if (!record.raw.unused.empty()) all.emplace(record.raw).unused.clear();
  const DriveSimulation simulation(setup, all ? *all : record.raw);
  const auto white = whiten(simulation.moving_residual(local(record, x)), record.noise);
  const auto unused = touched(record.raw.unused, record.noise);
  const std::size_t before = unused.empty() ? 0 : unused.size() - white.size();
  Eigen::VectorXd used(static_cast<Eigen::Index>(white.size()));
  Eigen::Index count = 0;
  for (std::size_t k = 0; k < white.size(); ++k)
    if (unused.empty() || !unused[before + k]) used(count++) = white[k];
  return used.head(count);
}

double FrictionProblem::cost(const std::vector<double>& x) const {
  constexpr double kWorst = std::numeric_limits<double>::infinity();
  const auto outside = [&](const Bound& b) {
    const double at = x[static_cast<std::size_t>(b.parameter)];
    return at < b.lower || at > b.upper;
  };
  if (!allowed(x) || std::any_of(bounds.begin(), bounds.end(), outside)) return kWorst;
  double sum = 0.0;
  for (const auto& record : records) sum += record.weight * record.weight * residual(record, x).squaredNorm();
  return std::isfinite(sum) ? sum : kWorst;
}

double FrictionProblem::clamped(int place, double value) const {
  for (const auto& b : bounds)
    if (b.parameter == place) value = std::clamp(value, b.lower, b.upper);
  return value;
}

Eigen::Index FrictionProblem::samples(const std::vector<double>& x) const {
  Eigen::Index sum = 0;
  for (const auto& record : records) sum += residual(record, x).size();
  return sum;
}

Eigen::VectorXd FrictionProblem::slope(const FrictionRecord& record, const std::vector<double>& x, int place,
                                       double step, Eigen::Index samples) const {
  Eigen::VectorXd slopes = Eigen::VectorXd::Zero(samples);
  const auto at = static_cast<std::size_t>(place);
  auto low = x, high = x;
  low[at] = clamped(place, x[at] - step);
  high[at] = clamped(place, x[at] + step);
  if (!(high[at] > low[at])) return slopes;
  const Eigen::VectorXd above = residual(record, high), below = residual(record, low);
  // A longer delay leaves fewer samples at the start.
  const auto common = std::min({above.size(), below.size(), samples});
  slopes.tail(common) = (above.tail(common) - below.tail(common)) / (high[at] - low[at]);
  return slopes;
}

Eigen::MatrixXd FrictionProblem::factor(const std::vector<double>& x, const Eigen::VectorXd& steps) const {
  const auto columns = static_cast<Eigen::Index>(active.size());
  std::vector<Eigen::MatrixXd> factors;
  Eigen::Index all = 0;
  for (const auto& record : records) {
    std::vector<Eigen::Index> own;  // the others' states do not move it
    for (Eigen::Index p = 0; p < columns; ++p)
      if (std::find(record.coordinates.begin(), record.coordinates.end(),
                    active[static_cast<std::size_t>(p)]) != record.coordinates.end())
        own.push_back(p);
    const auto count = static_cast<Eigen::Index>(own.size());
    const Eigen::VectorXd here = residual(record, x);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(std::max(here.size(), count + 1), count + 1);
    rows.col(count).head(here.size()) = here;
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index p = own[static_cast<std::size_t>(i)];
      rows.col(i).head(here.size()) =
          slope(record, x, active[static_cast<std::size_t>(p)], steps(p), here.size());
    }
    const Eigen::MatrixXd factor = record.weight * linalg::upper_factor(rows);
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(factor.rows(), columns + 1);
    for (Eigen::Index i = 0; i < count; ++i) spread.col(own[static_cast<std::size_t>(i)]) = factor.col(i);
    spread.col(columns) = factor.col(count);
    all += spread.rows();
    factors.push_back(std::move(spread));
  }
  Eigen::MatrixXd stacked(all, columns + 1);
  Eigen::Index row = 0;
  for (const auto& f : factors) {
    stacked.middleRows(row, f.rows()) = f;
    row += f.rows();
  }
  return stacked;
}

std::optional<FrictionFit> fit_with_friction(const FrictionProblem& problem, std::vector<double> x,
                                             Eigen::VectorXd deviations) {
  constexpr int kSteps = 12, kHalvings = 8;
  constexpr double kSmall = 0.03, kNear = 0.3, kRough = 1.2;  // of a standard deviation
  const auto count = static_cast<Eigen::Index>(problem.active.size());
  const auto samples = static_cast<double>(problem.samples(x));
  FrictionFit fit{std::move(x), 0.0, {}, false};
  fit.cost = problem.cost(fit.x);
  if (!std::isfinite(fit.cost)) return std::nullopt;
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::MatrixXd factor = problem.factor(fit.x, deviations);
    if (!factor.allFinite()) return std::nullopt;
    bool full_rank = false;
    const Eigen::MatrixXd slopes = factor.leftCols(count);
    const Eigen::MatrixXd inverse = inverse_normal_matrix(slopes, &full_rank);
    if (!full_rank) return std::nullopt;
    fit.covariance = fit.cost / std::max(1.0, samples - static_cast<double>(count)) * inverse;
    deviations = fit.covariance.diagonal().cwiseSqrt();
    const Eigen::VectorXd way = -inverse * (slopes.transpose() * factor.rightCols(1));
    const double length = way.cwiseAbs().cwiseQuotient(deviations).maxCoeff();
    fit.converged = length < kNear;
    if (!(length >= kSmall)) break;
    double there = fit.cost;
    for (int halving = 0; halving < kHalvings && !(there < fit.cost); ++halving) {
      auto next = fit.x;
      for (Eigen::Index i = 0; i < count; ++i)
        next[static_cast<std::size_t>(problem.active[static_cast<std::size_t>(i)])] +=
            std::ldexp(way(i), -halving);
      const double cost = problem.cost(next);
      if (!(cost < fit.cost)) continue;
      there = cost;
      fit.x = std::move(next);
      break;
    }
    if (!(there < fit.cost)) {
      // Instants that stay within a part of a sample leave the cost rough: no lower one along a step of
      // about a deviation is as near as it tells.
      if (!fit.converged && length < kRough && step > 0) {
        fit.covariance += way * way.transpose();
        fit.converged = fit.rough = true;
      }
      break;
    }
    fit.cost = there;
  }
  return fit;
}

}  // namespace resonid::fit::detail
