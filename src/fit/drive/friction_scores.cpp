// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/drive/friction_scores.hpp>
#include <fit/drive/output_error_cost.hpp>
#include <limits>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit::detail {
namespace {

constexpr int kLoad = common_friction(kLoadCoulomb), kMore = common_friction(kExcess),
              kOver = common_friction(kStribeckVelocity);

double& at(std::vector<double>& x, int place) { return x[static_cast<std::size_t>(place)]; }
double at(const std::vector<double>& x, int place) { return x[static_cast<std::size_t>(place)]; }

/// One thing that may be lacking: a place moved from x, by `step`.
struct Trial {
  int place;
  std::vector<double> x;
  double step;
  double found = 0.0, gain = 0.0;
};

/// Speed of the driven side while it moves, rms, over all records.
double speed_of(const FrictionProblem& problem, const std::vector<double>& x) {
  double square = 0.0, count = 0.0;
  for (const auto& record : problem.records) {
    const auto motion = DriveSimulation(problem.setup, record.raw).motion(problem.local(record, x));
    for (const double v : motion.velocity.front()) {
      square += v * v;
      count += 1.0;
    }
  }
  return std::sqrt(square / std::max(1.0, count));
}

/// What friction may be like: that which is found, or a part of what drives the machine.
double torque_of(const FrictionProblem& problem, const std::vector<double>& x) {
  constexpr double kPart = 0.03;
  double drives = 0.0;
  for (const auto& record : problem.records) {
    const auto motion = DriveSimulation(problem.setup, record.raw).motion(problem.local(record, x));
    drives = std::max(drives, deviation(motion.torque));
  }
  return std::max({at(x, kCommonCoulomb), at(x, kLoad), kPart * drives});
}

std::vector<Trial> trials_of(const FrictionProblem& problem, const std::vector<double>& x, double torque,
                             const FurtherFriction& estimated, bool driven) {
  std::vector<Trial> trials;
  constexpr double kPart = 0.2;
  if (!estimated.load_coulomb && problem.setup.structure != Structure::rigid)
    trials.push_back({kLoad, x, kPart * torque});
  if (!driven || estimated.breakaway) return trials;
  const double speed = speed_of(problem, x);
  for (const double part : {0.01, 0.03, 0.1, 0.3}) {
    Trial trial{kMore, x, kPart * torque};
    at(trial.x, kOver) = part * speed;
    trials.push_back(std::move(trial));
  }
  return trials;
}

/// [J r] of one record, weighted: active places, trials, residual.
Eigen::MatrixXd rows_of(const FrictionProblem& problem, const FrictionRecord& record,
                        const std::vector<double>& x, const Eigen::VectorXd& steps,
                        const std::vector<Trial>& trials) {
  const Eigen::VectorXd here = problem.residual(record, x);
  const auto own = static_cast<Eigen::Index>(problem.active.size());
  const auto tried = static_cast<Eigen::Index>(trials.size());
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(here.size(), own + tried + 1);
  const auto& mine = record.coordinates;
  for (Eigen::Index p = 0; p < own; ++p) {
    const int place = problem.active[static_cast<std::size_t>(p)];
    if (std::find(mine.begin(), mine.end(), place) != mine.end())
      rows.col(p) = problem.slope(record, x, place, steps(p), here.size());
  }
  for (Eigen::Index t = 0; t < tried; ++t) {
    const auto& trial = trials[static_cast<std::size_t>(t)];
    rows.col(own + t) = problem.slope(record, trial.x, trial.place, trial.step, here.size());
  }
  rows.col(own + tried) = here;
  return record.weight * rows;
}

/// Gains and one step's values; `rows` is the triangular factor of as many rows as `samples`.
void score(const Eigen::MatrixXd& rows, Eigen::Index own, double samples, std::vector<Trial>& trials) {
  Eigen::MatrixXd taken = rows.leftCols(own);
  for (Eigen::Index i = 0; i < own; ++i) taken.col(i) /= std::max(taken.col(i).norm(), 1e-300);
  Eigen::MatrixXd rest = rows.rightCols(rows.cols() - own);
  const Eigen::VectorXd before = rest.colwise().squaredNorm();
  rest -= taken * (linalg::pseudo_inverse(taken).matrix * rest);
  const auto residual = rest.col(rest.cols() - 1);
  const double variance = before(rest.cols() - 1) / std::max(1.0, samples - static_cast<double>(own));
  constexpr double kSame = 1e-8;  // of a slope that the estimated ones hold already
  for (std::size_t t = 0; t < trials.size(); ++t) {
    const auto column = static_cast<Eigen::Index>(t);
    const double size = rest.col(column).squaredNorm();
    if (!(size > kSame * before(column)) || !(variance > 0.0)) continue;
    const double along = rest.col(column).dot(residual);
    trials[t].found = -along / size;
    trials[t].gain = along * along / (size * variance);
  }
}

}  // namespace

std::vector<int> coordinates_of(const FurtherFriction& friction) {
  std::vector<int> places;
  if (friction.load_coulomb) places.push_back(kLoad);
  if (friction.breakaway) places.push_back(kMore);
  if (friction.stribeck_velocity) places.push_back(kOver);
  return places;
}

std::vector<Bound> friction_bounds(const FurtherFriction& friction) {
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  std::vector<Bound> bounds = {{kLoad, 0.0, kInfinite}, {kMore, 0.0, kInfinite}};
  constexpr double kSlower = 0.01;  // of the start
  if (friction.stribeck_velocity)
    bounds.push_back({kOver, kSlower * friction.stribeck_velocity->value, kInfinite});
  return bounds;
}

void store_friction(double coulomb, const FurtherFriction& friction, std::vector<double>& x) {
  at(x, kCommonCoulomb) = coulomb;
  at(x, kLoad) = friction.load_coulomb ? friction.load_coulomb->value : 0.0;
  at(x, kMore) = friction.breakaway ? friction.breakaway->value - coulomb : 0.0;
  at(x, kOver) = friction.stribeck_velocity ? friction.stribeck_velocity->value : 0.0;
}

FurtherFriction further_friction_of(const FurtherFriction& asked, const std::vector<double>& x,
                                    const Eigen::MatrixXd& covariance) {
  const auto sum = [&](int place, bool with_coulomb) {
    double value = at(x, place), variance = covariance(place, place);
    if (with_coulomb) {
      value += at(x, kCommonCoulomb);
      variance += covariance(kCommonCoulomb, kCommonCoulomb) + 2.0 * covariance(place, kCommonCoulomb);
    }
    return data::Estimate{value, std::sqrt(std::max(0.0, variance))};
  };
  FurtherFriction found;
  if (asked.load_coulomb) found.load_coulomb = sum(kLoad, false);
  if (asked.breakaway) found.breakaway = sum(kMore, true);
  if (asked.stribeck_velocity) found.stribeck_velocity = sum(kOver, false);
  return found;
}

std::vector<LackingFriction> score_friction(const FrictionProblem& problem, const std::vector<double>& x,
                                            const Eigen::MatrixXd& covariance,
                                            const FurtherFriction& estimated, bool driven) {
  const double torque = torque_of(problem, x);
  if (!(torque > 0.0)) return {};
  auto trials = trials_of(problem, x, torque, estimated, driven);
  if (trials.empty()) return {};
  const auto own = static_cast<Eigen::Index>(problem.active.size());
  Eigen::VectorXd steps(own);
  for (Eigen::Index i = 0; i < own; ++i) {
    const int place = problem.active[static_cast<std::size_t>(i)];
    steps(i) = std::sqrt(std::max(0.0, covariance(place, place)));
  }
  Eigen::MatrixXd rows(0, 0);
  for (const auto& record : problem.records) {
    const Eigen::MatrixXd mine = rows_of(problem, record, x, steps, trials);
    const Eigen::Index before = rows.rows();
    rows.conservativeResize(before + mine.rows(), mine.cols());
    rows.bottomRows(mine.rows()) = mine;
  }
  if (!rows.allFinite()) return {};
  score(linalg::upper_factor(rows), own, static_cast<double>(rows.rows()), trials);
  std::vector<LackingFriction> lacking;
  const double coulomb = std::max(0.0, at(x, kCommonCoulomb));
  constexpr double kLeast = 0.05, kMost = 1.0;  // of the friction there is: a start must be near
  const FurtherFriction now = further_friction_of(estimated, x, covariance);
  for (const auto& trial : trials) {
    if (!(trial.found > 0.0)) continue;
    const double size = std::clamp(trial.found, kLeast * torque, kMost * torque);
    LackingFriction lack{trial.gain, coulomb, now};
    if (trial.place == kLoad) lack.start.load_coulomb = data::Estimate{size, 0.0};
    if (trial.place == kMore) {
      lack.start.breakaway = data::Estimate{coulomb + size, 0.0};
      lack.start.stribeck_velocity = data::Estimate{at(trial.x, kOver), 0.0};
    }
    lacking.push_back(lack);
  }
  return lacking;
}

}  // namespace resonid::fit::detail
