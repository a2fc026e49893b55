// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/planning/detail/power_distribution.hpp>

#include "linalg/decompositions.hpp"
#include "planning/waveform.hpp"

namespace resonid::planning {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMostIterations = 6000;
constexpr double kWantedGap = 2e-3;
constexpr int kEigenvaluePower = 8;  // of Criterion::e

/// Value and slopes of the criterion at some powers.
struct Slopes {
  VectorXd gain;       ///< [line] -d value / d power, averaged over the models.
  VectorXd target;     ///< [target] mean of (deviation / wanted)^2.
  double value = 0.0;  ///< sum of gain * power: the value itself for accuracy and a, constant for d.
};

class Design {
 public:
  explicit Design(const DesignProblem& problem) : problem_(problem) {}

  [[nodiscard]] Slopes slopes(const VectorXd& power, const VectorXd& weight) const {
    Slopes s{VectorXd::Zero(power.size()), VectorXd::Zero(weight.size()), 0.0};
    const double part = 1.0 / static_cast<double>(problem_.models.size());
    for (const auto& model : problem_.models) {
      const MatrixXd variance = covariance(model, power);
      const MatrixXd w = part * weighting(model, variance, weight);
      const MatrixXd re = model.sensitivity.real(), im = model.sensitivity.imag();
      s.gain += ((w * re).cwiseProduct(re) + (w * im).cwiseProduct(im)).colwise().sum().transpose();
      s.target += part * (model.targets * variance).cwiseProduct(model.targets).rowwise().sum();
    }
    s.value = s.gain.dot(power);
    return s;
  }

  /// Logarithm of the criterion in the dimension of a variance, averaged over the models (not for accuracy).
  [[nodiscard]] double log_value(const VectorXd& power) const {
    double sum = 0.0;
    for (const auto& model : problem_.models) {
      const MatrixXd v = covariance(model, power);
      const auto n = static_cast<double>(v.rows());
      if (problem_.criterion == Criterion::d) sum += linalg::RealLdlt(v).d().array().log().sum() / n;
      if (problem_.criterion == Criterion::a) sum += v.trace();
      if (problem_.criterion == Criterion::e) {
        MatrixXd product = v / v.trace();
        for (int i = 1; i < kEigenvaluePower; i *= 2) product = (product * product).eval();
        sum += std::pow(product.trace(), 1.0 / kEigenvaluePower) * v.trace();
      }
    }
    sum /= static_cast<double>(problem_.models.size());
    return problem_.criterion == Criterion::d ? sum : std::log(sum);
  }

  /// Power of the multiplicative step that neither crawls nor swings.
  [[nodiscard]] double exponent() const {
    switch (problem_.criterion) {
      case Criterion::d:
        return 1.0;
      case Criterion::e:
        return 1.0 / (kEigenvaluePower + 1);
      default:
        return 0.5;
    }
  }

 private:
  static MatrixXd covariance(const DesignModel& model, const VectorXd& power) {
    const MatrixXd re = model.sensitivity.real(), im = model.sensitivity.imag();
    MatrixXd m = re * power.asDiagonal() * re.transpose() + im * power.asDiagonal() * im.transpose();
    const VectorXd size = m.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    m = size.asDiagonal() * m * size.asDiagonal();
    return size.asDiagonal() * linalg::RealLdlt(m).solve(MatrixXd::Identity(m.rows(), m.cols())) *
           size.asDiagonal();
  }

  /// W with  -d value / d power_k = d_k^H W d_k.
  [[nodiscard]] MatrixXd weighting(const DesignModel& model, const MatrixXd& v,
                                   const VectorXd& weight) const {
    switch (problem_.criterion) {
      case Criterion::d:
        return v / static_cast<double>(v.rows());
      case Criterion::a:
        return v * v;
      case Criterion::e: {
        const double unit = v.trace();  // powers of relative size; a common factor does not matter
        MatrixXd power = v / unit;
        MatrixXd product = power;
        for (int i = 0; i < kEigenvaluePower; ++i) product = (product * power).eval();
        return product;
      }
      case Criterion::accuracy:
        break;
    }
    const MatrixXd columns = v * model.targets.transpose();
    return columns * weight.asDiagonal() * columns.transpose();
  }

  const DesignProblem& problem_;
};

}  // namespace

namespace detail {

Criterial criterial(const DesignProblem& problem, const VectorXd& power) {
  const Design design(problem);
  const auto targets = problem.models.front().targets.rows();
  VectorXd weight = VectorXd::Ones(targets);
  Criterial result;
  if (problem.criterion == Criterion::accuracy) {
    // The largest target, smoothly: (sum of v^r)^(1/r).
    constexpr double kSmooth = 12.0;
    const VectorXd v = design.slopes(power, weight).target;
    const VectorXd part = v / v.maxCoeff();
    const double sum = part.array().pow(kSmooth).sum();
    result.log_value = std::log(v.maxCoeff()) + std::log(sum) / kSmooth;
    weight = part.array().pow(kSmooth - 1.0) / (sum * v.maxCoeff());
    result.slope = -design.slopes(power, weight).gain;
    return result;
  }
  const Slopes s = design.slopes(power, weight);
  result.log_value = design.log_value(power);
  result.slope = -s.gain / s.value;
  return result;
}

}  // namespace detail

PowerDistribution distribute_power(const DesignProblem& problem) {
  const Design design(problem);
  const auto lines = problem.use.cols();
  const auto limits = problem.use.rows();
  const auto targets = problem.models.front().targets.rows();
  VectorXd price = VectorXd::Constant(limits, 1.0 / static_cast<double>(limits));
  VectorXd weight = VectorXd::Constant(targets, 1.0 / std::max(1.0, static_cast<double>(targets)));
  PowerDistribution result;
  VectorXd power = (problem.use.transpose() * price).cwiseInverse() / static_cast<double>(lines);
  for (result.iterations = 1; result.iterations <= kMostIterations; ++result.iterations) {
    const VectorXd cost = problem.use.transpose() * price;
    power /= cost.dot(power);
    const Slopes s = design.slopes(power, weight);
    const VectorXd ratio = s.gain.cwiseQuotient(cost) / s.value;  // 1 for all lines in use at the optimum
    const VectorXd used = problem.use * power;
    // Best value >= value at these prices and weights, less what the best line could still gain.
    const double lag = problem.criterion == Criterion::accuracy && targets > 0
                           ? 1.0 - weight.dot(s.target) / (weight.sum() * s.target.maxCoeff())
                           : 0.0;
    result.gap = std::max({ratio.maxCoeff() - 1.0, used.maxCoeff() - 1.0, lag});
    if (result.gap < kWantedGap) break;
    power = power.cwiseProduct(VectorXd(ratio.array().pow(design.exponent())));
    price = price.cwiseProduct(VectorXd(used.array().max(1e-12).pow(0.5)));
    price = price.cwiseMax(1e-9) / price.cwiseMax(1e-9).sum();
    if (problem.criterion == Criterion::accuracy && targets > 0) {
      weight = weight.cwiseProduct(VectorXd((s.target / s.target.maxCoeff()).array().pow(0.5)));
      weight = weight.cwiseMax(1e-9) / weight.cwiseMax(1e-9).sum();
    }
  }
  power /= (problem.use * power).maxCoeff();
  result.power = power;
  result.used = problem.use * power;
  return result;
}

}  // namespace resonid::planning
