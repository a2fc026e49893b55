// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/black_box_search.hpp>
#include <limits>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

/// Normal equations with the linear part eliminated.
struct Reduced {
  Eigen::MatrixXd normal;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd back;  ///< linear step = own - back * non-linear step
  Eigen::VectorXd own;
};

Reduced reduce(const BlackBoxEvaluation& e, Eigen::Index n) {
  const auto p = e.gradient.size() - n;
  const Eigen::MatrixXd inverse = invert_normal(e.normal.bottomRightCorner(p, p));
  const Eigen::MatrixXd across = e.normal.bottomLeftCorner(p, n);
  Reduced r;
  r.back = inverse * across;
  r.own = inverse * e.gradient.tail(p);
  r.normal = e.normal.topLeftCorner(n, n) - across.transpose() * r.back;
  r.gradient = e.gradient.head(n) - across.transpose() * r.own;
  return r;
}

double pole_limit(double horizon) { return 1.0 + 3.0 / horizon; }

/// The state after a step in [alpha | weights, taps | extra]; nothing when its poles leave the limit.
std::optional<BlackBoxState> moved(const BlackBoxProblem& problem, const BlackBoxState& from,
                                   const Eigen::VectorXd& step) {
  const auto& layout = problem.layout();
  const auto n = layout.order;
  const auto horizon = static_cast<double>(problem.samples());
  const Eigen::VectorXd alpha = step.head(n);
  auto next = renewed(from.basis, alpha, horizon, pole_limit(horizon));
  if (!next) return std::nullopt;
  BlackBoxState state;
  state.taps = from.taps + step.segment(2 * n, layout.taps);
  state.weights = from.weights + step.segment(n, n);
  // (c F + h)/(1 + alpha F) in the renewed basis
  if (layout.taps == 1) state.weights -= state.taps(0) * alpha;
  state.extra = from.extra;
  const auto extras = step.size() - 2 * n - layout.taps;
  if (state.extra.size() == extras) state.extra += step.tail(extras);
  if (n > 0) {
    state.weights = (next->states.transpose() * state.weights).eval();
    if (!layout.controller && layout.initial_state && state.extra.size() == extras)
      state.extra.tail(n) = (next->states.transpose() * state.extra.tail(n)).eval();
  }
  state.basis = std::move(next->realisation);
  return state;
}

/// How the largest pole grows along alpha, if it is about to leave the limit.
struct Edge {
  Eigen::VectorXd outward;  ///< d |p| / d [alpha | ...]
  double room = 0.0;
};
Edge edge_of(const Realisation& basis, double limit, Eigen::Index size) {
  const auto [values, right] = linalg::eigenpairs(basis.transition);
  Eigen::Index at = 0;
  const double radius = values.cwiseAbs().maxCoeff(&at);
  const std::complex<double> through =
      linalg::ComplexLu(right).solve(basis.input.cast<std::complex<double>>())(at);
  const std::complex<double> direction = std::conj(values(at)) / radius;
  Edge edge{Eigen::VectorXd::Zero(size), limit - radius};
  edge.outward.head(basis.order()) = -(direction * through * right.col(at)).real();
  return edge;
}

/// Shortens a step that would carry the largest pole over the limit, along the edge.
Eigen::VectorXd kept_inside(const Eigen::VectorXd& step, const Eigen::MatrixXd& normal,
                            const Realisation& basis, double limit) {
  if (basis.order() == 0) return step;
  const Edge edge = edge_of(basis, limit, step.size());
  constexpr double kNearly = 0.9;  // the pole's radius is not linear in alpha
  const double excess = edge.outward.dot(step) - kNearly * edge.room;
  if (!(edge.room >= 0.0) || !(excess > 0.0)) return step;
  const Eigen::VectorXd back = solve_normal(normal, edge.outward);
  const double slope = edge.outward.dot(back);
  if (!(slope > 0.0)) return step;
  return step - back * (excess / slope);
}

bool finished(const BlackBoxEvaluation& e, double predicted, double energy, double tolerance) {
  return predicted <= tolerance * e.squares || e.squares <= 1e-30 * energy;
}

double output_energy(const BlackBoxProblem& problem) {
  double sum = 0.0;
  for (const double v : problem.output()) sum += v * v;
  return sum;
}

/// Poles outside the unit circle mirrored into it.
std::vector<std::complex<double>> mirrored(const Eigen::VectorXcd& poles) {
  std::vector<std::complex<double>> result;
  for (std::complex<double> p : poles) {
    const double radius = std::abs(p);
    if (radius > 1.0) p /= radius * radius;
    result.push_back(p);
  }
  return result;
}

/// (A_new/A) y = (B_new/A) u, solved for A_new and repeated (Steiglitz and McBride 1965). Goes on from `at`
/// and keeps the best state in `best`.
void steiglitz_mcbride(const BlackBoxProblem& problem, BlackBoxState& at, BlackBoxSearch& best,
                       int iterations) {
  const auto n = problem.layout().order;
  for (int i = 0; i < iterations; ++i) {
    auto e = problem.evaluate(at, Regressor::record);
    if (!e.valid) return;
    if (!best.evaluation.valid || e.cost < best.evaluation.cost) best = BlackBoxSearch{at, e, false};
    const Eigen::VectorXd alpha = solve_normal(e.normal, e.gradient).head(n);
    const Realisation next{at.basis.transition - at.basis.input * alpha.transpose(), at.basis.input};
    if (!next.transition.allFinite()) return;
    at = state_with_poles(problem, mirrored(next.poles()));
    if (alpha.norm() < 1e-9) return;
  }
}

}  // namespace

BlackBoxState state_with_poles(const BlackBoxProblem& problem,
                               const std::vector<std::complex<double>>& poles) {
  BlackBoxState state;
  state.basis = realisation_of(poles, static_cast<double>(problem.samples()));
  return state;
}

BlackBoxSearch search(const BlackBoxProblem& problem, BlackBoxState start, const SearchEffort& effort) {
  BlackBoxSearch result{std::move(start), {}, false};
  result.evaluation = problem.evaluate(result.state, Regressor::model);
  if (!result.evaluation.valid) return result;
  const double energy = output_energy(problem);
  const auto n = problem.nonlinear();
  double damping = 0.0;
  for (int iteration = 0; iteration < effort.iterations; ++iteration) {
    const Reduced r = reduce(result.evaluation, n);
    Eigen::MatrixXd normal = r.normal;
    normal.diagonal() += damping * r.normal.diagonal();
    const double limit = pole_limit(static_cast<double>(problem.samples()));
    const Eigen::VectorXd step =
        kept_inside(solve_normal(normal, r.gradient), normal, result.state.basis, limit);
    const double predicted = step.dot(r.gradient);
    if (n == 0 || finished(result.evaluation, predicted, energy, effort.tolerance)) {
      result.converged = true;
      return result;
    }
    Eigen::VectorXd whole(result.evaluation.gradient.size());
    whole << step, r.own - r.back * step;
    auto trial = moved(problem, result.state, whole);
    BlackBoxEvaluation e;
    if (trial) e = problem.evaluate(*trial, Regressor::model);
    if (e.valid && e.cost < result.evaluation.cost) {
      result.state = std::move(*trial);
      result.evaluation = std::move(e);
      damping = damping < 1e-6 ? 0.0 : 0.1 * damping;
    } else {
      // At the rounding floor no step helps: that is an end, not a failure.
      if (predicted <= 1e-9 * result.evaluation.squares || damping > 1e12) {
        result.converged = predicted <= 1e-6 * result.evaluation.squares;
        return result;
      }
      damping = std::max(10.0 * damping, 1e-4);
    }
  }
  return result;
}

BlackBoxSearch search_near(const BlackBoxProblem& problem, BlackBoxState start, const SearchEffort& effort) {
  constexpr int kRounds = 3;
  BlackBoxSearch best;
  BlackBoxState at = start;
  steiglitz_mcbride(problem, at, best, kRounds);
  return search(problem, best.evaluation.valid ? std::move(best.state) : std::move(start), effort);
}

BlackBoxSearch search_from_scratch(const BlackBoxProblem& problem, const SearchEffort& effort) {
  struct Start {
    BlackBoxState at;
    BlackBoxSearch best;
  };
  const auto n = static_cast<std::size_t>(problem.layout().order);
  std::vector<std::unique_ptr<Start>> starts;
  const auto advance = [&](std::size_t kept, int rounds) {
    for (auto& s : starts) steiglitz_mcbride(problem, s->at, s->best, rounds);
    starts.erase(
        std::remove_if(starts.begin(), starts.end(), [](const auto& s) { return !s->best.evaluation.valid; }),
        starts.end());
    std::sort(starts.begin(), starts.end(),
              [](const auto& a, const auto& b) { return a->best.evaluation.cost < b->best.evaluation.cost; });
    if (starts.size() > kept) starts.resize(kept);
  };
  for (const double pole : {0.0, 0.5, 0.8, 0.9, 0.95, 0.98}) {
    starts.push_back(std::make_unique<Start>());
    starts.back()->at = state_with_poles(problem, std::vector<std::complex<double>>(n, pole));
    if (n == 0) break;
  }
  advance(3, 4);
  advance(2, 6);
  BlackBoxSearch best;
  for (auto& start : starts) {
    const double cost = start->best.evaluation.cost;
    // A start that Steiglitz-McBride has already brought to the same place need not be refined twice.
    if (best.evaluation.valid && cost > best.evaluation.cost && cost < 1.02 * best.evaluation.cost) continue;
    auto refined = search(problem, std::move(start->best.state), effort);
    if (refined.evaluation.valid &&
        (!best.evaluation.valid || refined.evaluation.cost < best.evaluation.cost))
      best = std::move(refined);
  }
  return best;
}

}  // namespace resonid::fit::detail
