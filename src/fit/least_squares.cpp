// SPDX-License-Identifier: MIT
#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <fit/least_squares.hpp>
#include <utility>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {

namespace {

using Jacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kLargest = 1e150;  ///< Residual whose square is a number.

/// Remembers its last evaluation with derivatives: a solver that begins where the start was checked, and the
/// result where it ended, ask for the same once more.
class Remembering final : public ceres::CostFunction {
 public:
  explicit Remembering(std::unique_ptr<ceres::CostFunction> function) : function_(std::move(function)) {
    set_num_residuals(function_->num_residuals());
    *mutable_parameter_block_sizes() = function_->parameter_block_sizes();
    residuals_.resize(num_residuals());
    jacobian_.resize(num_residuals(), parameter_block_sizes().front());
  }

  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    if (jacobians == nullptr || jacobians[0] == nullptr)
      return function_->Evaluate(blocks, residuals, jacobians);
    const Eigen::Map<const Eigen::VectorXd> x(blocks[0], jacobian_.cols());
    if (x_.size() == 0 || x_ != x) {
      x_ = x;
      double* slopes[] = {jacobian_.data()};
      succeeded_ = function_->Evaluate(blocks, residuals_.data(), slopes);
    }
    if (!succeeded_) return false;
    std::copy(residuals_.begin(), residuals_.end(), residuals);
    std::copy(jacobian_.data(), jacobian_.data() + jacobian_.size(), jacobians[0]);
    return true;
  }

 private:
  std::unique_ptr<ceres::CostFunction> function_;
  mutable Eigen::VectorXd x_, residuals_;
  mutable Jacobian jacobian_;
  mutable bool succeeded_ = false;
};

/// Whether the cost falls from any of these bounds inwards.
bool leaves_a_bound(const Eigen::VectorXd& residuals, const Jacobian& jacobian, std::span<const double> x,
                    const std::vector<const Bound*>& at) {
  return std::any_of(at.begin(), at.end(), [&](const Bound* b) {
    const double slope = jacobian.col(b->parameter).dot(residuals);
    return x[static_cast<std::size_t>(b->parameter)] <= b->lower ? slope < 0.0 : slope > 0.0;
  });
}

}  // namespace

LeastSquaresResult minimise(std::unique_ptr<ceres::CostFunction> cost, std::span<double> x,
                            std::span<const bool> active, std::span<const Bound> bounds,
                            const Effort& effort) {
  Remembering function(std::move(cost));
  ceres::Problem::Options problem_options;
  problem_options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ceres::Problem problem(problem_options);
  problem.AddResidualBlock(&function, nullptr, x.data());
  LeastSquaresResult result;
  const auto parameters = static_cast<int>(x.size());
  for (int i = 0; i < parameters; ++i)
    if (active[static_cast<std::size_t>(i)]) result.active.push_back(i);
  for (const auto& bound : bounds) {
    problem.SetParameterLowerBound(x.data(), bound.parameter, bound.lower);
    problem.SetParameterUpperBound(x.data(), bound.parameter, bound.upper);
  }
  // Asked first, since Ceres writes to the log about a start that cannot be evaluated.
  const int rows = function.num_residuals();
  Eigen::VectorXd residuals(rows);
  Jacobian jacobian(rows, parameters);
  const auto evaluates = [&] {
    const double* blocks[] = {x.data()};
    double* jacobians[] = {jacobian.data()};
    return function.Evaluate(blocks, residuals.data(), jacobians);
  };
  if (!evaluates() || !residuals.allFinite() || residuals.cwiseAbs().maxCoeff() > kLargest) {
    result.jacobian = Eigen::MatrixXd::Zero(rows, static_cast<Eigen::Index>(result.active.size()));
    result.gradient = Eigen::VectorXd::Zero(result.jacobian.cols());
    return result;
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = effort.iterations;
  options.function_tolerance = effort.function_tolerance;
  options.parameter_tolerance = 1e-11;
  options.gradient_tolerance = 1e-14;
  options.logging_type = ceres::SILENT;
  // A search along every step that is cut at a bound costs as much as the fit itself. What lies at its bound
  // is kept there instead, until the others are found and the cost says whether it would leave again.
  const int searches = std::exchange(options.max_num_line_search_step_size_iterations, 0);
  ceres::Solver::Summary summary;
  std::vector<const Bound*> kept;
  const auto solve = [&] {
    std::vector<int> constant;
    for (int i = 0; i < parameters; ++i)
      if (!active[static_cast<std::size_t>(i)] ||
          std::any_of(kept.begin(), kept.end(), [i](const Bound* b) { return b->parameter == i; }))
        constant.push_back(i);
    if (static_cast<int>(constant.size()) == parameters) return;
    problem.SetManifold(x.data(),
                        constant.empty() ? nullptr : new ceres::SubsetManifold(parameters, constant));
    ceres::Solve(options, &problem, &summary);
  };
  const auto at_bounds = [&] {
    std::vector<const Bound*> all;
    for (const auto& b : bounds) {
      const double at = x[static_cast<std::size_t>(b.parameter)];
      if (active[static_cast<std::size_t>(b.parameter)] && (at <= b.lower || at >= b.upper))
        all.push_back(&b);
    }
    return all;
  };
  solve();
  bool wanders = false;  // over bounds
  constexpr int kTurns = 4;
  for (int turn = 0;; ++turn) {
    const auto now = at_bounds();
    if (now == kept) break;
    wanders = turn == kTurns;
    if (wanders) break;
    kept = now;
    solve();
    const bool settled = summary.termination_type == ceres::CONVERGENCE && at_bounds() == kept;
    wanders = settled && (!evaluates() || leaves_a_bound(residuals, jacobian, x, kept));
    if (wanders) break;
  }
  if (wanders || (kept.empty() && !bounds.empty() && summary.termination_type != ceres::CONVERGENCE)) {
    kept.clear();
    options.max_num_line_search_step_size_iterations = searches;
    solve();
  }
  result.converged = summary.termination_type == ceres::CONVERGENCE;
  result.cost = summary.final_cost;

  if (!evaluates()) {
    result.converged = false;
    jacobian.setZero();
    residuals.setZero();
  }
  result.jacobian.resize(rows, static_cast<Eigen::Index>(result.active.size()));
  for (std::size_t i = 0; i < result.active.size(); ++i)
    result.jacobian.col(static_cast<Eigen::Index>(i)) = jacobian.col(result.active[i]);
  result.gradient = result.jacobian.transpose() * residuals;
  return result;
}

LeastSquaresResult minimise_linear(const ceres::CostFunction& function, std::span<double> x,
                                   std::span<const bool> active) {
  LeastSquaresResult result;
  for (std::size_t i = 0; i < active.size(); ++i)
    if (active[i]) result.active.push_back(static_cast<int>(i));
  const auto count = static_cast<Eigen::Index>(result.active.size());
  Eigen::VectorXd residuals(function.num_residuals());
  Jacobian jacobian(residuals.size(), static_cast<Eigen::Index>(x.size()));
  const double* blocks[] = {x.data()};
  double* jacobians[] = {jacobian.data()};
  result.jacobian = Eigen::MatrixXd::Zero(residuals.size(), count);
  result.gradient = Eigen::VectorXd::Zero(count);
  if (!function.Evaluate(blocks, residuals.data(), jacobians) || !residuals.allFinite() ||
      residuals.cwiseAbs().maxCoeff() > kLargest || !jacobian.allFinite())
    return result;
  for (Eigen::Index i = 0; i < count; ++i)
    result.jacobian.col(i) = jacobian.col(result.active[static_cast<std::size_t>(i)]);
  Eigen::VectorXd size = result.jacobian.colwise().norm().transpose();
  for (Eigen::Index i = 0; i < count; ++i)
    if (!(size(i) > 0.0)) size(i) = 1.0;
  const Eigen::VectorXd scale = size.cwiseInverse();
  const Eigen::VectorXd step =
      scale.cwiseProduct(linalg::shortest_solution(result.jacobian * scale.asDiagonal(), -residuals));
  residuals += result.jacobian * step;
  for (Eigen::Index i = 0; i < count; ++i)
    x[static_cast<std::size_t>(result.active[static_cast<std::size_t>(i)])] += step(i);
  result.cost = 0.5 * residuals.squaredNorm();
  result.converged = std::isfinite(result.cost);
  result.gradient = result.jacobian.transpose() * residuals;
  return result;
}

Eigen::MatrixXd inverse_normal_matrix(const Eigen::MatrixXd& jacobian, bool* full_rank) {
  const auto n = jacobian.cols();
  // Columns scaled to length one first: the coordinates differ by orders of magnitude.
  Eigen::VectorXd scale = jacobian.colwise().norm().transpose();
  for (Eigen::Index i = 0; i < n; ++i)
    if (!(scale(i) > 0.0)) scale(i) = 1.0;
  const Eigen::VectorXd inverse_scale = scale.cwiseInverse();
  // The triangular factor has the same J^T J; a pseudo-inverse of J itself would be as large as the data
  // squared.
  const auto [inverse, rank] =
      linalg::pseudo_inverse(linalg::upper_factor(jacobian * inverse_scale.asDiagonal()));
  if (full_rank != nullptr) *full_rank = rank == n;
  return inverse_scale.asDiagonal() * (inverse * inverse.transpose()) * inverse_scale.asDiagonal();
}

Eigen::MatrixXd covariance(const LeastSquaresResult& result, int parameters, bool* full_rank) {
  Eigen::MatrixXd full = Eigen::MatrixXd::Zero(parameters, parameters);
  const auto n = result.jacobian.cols();
  if (n == 0) return full;
  const Eigen::MatrixXd core = inverse_normal_matrix(result.jacobian, full_rank);
  for (Eigen::Index i = 0; i < n; ++i)
    for (Eigen::Index j = 0; j < n; ++j)
      full(result.active[static_cast<std::size_t>(i)], result.active[static_cast<std::size_t>(j)]) =
          core(i, j);
  return full;
}

}  // namespace resonid::fit::detail
