// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/join/estimate_combination.hpp>
#include <iterator>
#include <resonid/base/detail/statistics.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::identification::detail {
namespace {

using fit::DriveModel;
using Indices = std::vector<Eigen::Index>;

/// Positive, and known to a factor at least.
bool logarithmic(int parameter) { return fit::has_parameter(fit::Structure::three_mass, parameter); }

double value_of(const DriveModel& model, int parameter) {
  return model.value(static_cast<fit::Parameter>(parameter));
}

Eigen::MatrixXd inverse(const Eigen::MatrixXd& positive) {
  // Scaled: delays in seconds stand beside logarithms.
  const Eigen::VectorXd size = positive.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd unit = size.asDiagonal() * positive * size.asDiagonal();
  const Eigen::MatrixXd inverted =
      linalg::Llt(unit).solve(Eigen::MatrixXd::Identity(unit.rows(), unit.cols()));
  return size.asDiagonal() * inverted * size.asDiagonal();
}

/// Covariance of the known coordinates.
Eigen::MatrixXd known_covariance(const ParameterEstimate& e) {
  return inverse(e.fisher_information(e.known, e.known));
}

/// Places of `some` in `all`; both ascend.
Indices places(const Indices& some, const Indices& all) {
  Indices at;
  for (const auto i : some) at.push_back(std::lower_bound(all.begin(), all.end(), i) - all.begin());
  return at;
}

}  // namespace

ParameterEstimate estimate_of(const DriveModel& model) {
  ParameterEstimate e;
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (model.estimated[static_cast<std::size_t>(i)]) e.parameters.push_back(i);
  const auto n = static_cast<Eigen::Index>(e.parameters.size());
  e.x.resize(n);
  e.fisher_information = Eigen::MatrixXd::Zero(n, n);
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const int p = e.parameters[static_cast<std::size_t>(i)];
    const double value = value_of(model, p);
    e.x(i) = logarithmic(p) ? std::log(value) : value;
    scale(i) = logarithmic(p) ? 1.0 / value : 1.0;
  }
  const Eigen::MatrixXd covariance =
      scale.asDiagonal() * model.covariance(e.parameters, e.parameters) * scale.asDiagonal();
  if (!e.x.allFinite() || !covariance.allFinite() || !linalg::Llt(covariance).succeeded()) return e;
  for (Eigen::Index i = 0; i < n; ++i)
    if (!logarithmic(e.parameters[static_cast<std::size_t>(i)]) ||
        covariance(i, i) < kCriteria.known_parameter * kCriteria.known_parameter)
      e.known.push_back(i);
  // Friction and delay of a machine whose inertia is not known are those of another.
  if (std::none_of(e.known.begin(), e.known.end(),
                   [&](Eigen::Index i) { return logarithmic(e.parameters[static_cast<std::size_t>(i)]); }))
    e.known.clear();
  if (!e.known.empty()) e.fisher_information(e.known, e.known) = inverse(covariance(e.known, e.known));
  return e;
}

ParameterEstimate combined(const std::vector<ParameterEstimate>& all, std::size_t but) {
  ParameterEstimate sum = all.front();
  sum.fisher_information.setZero();
  sum.known.clear();
  Eigen::VectorXd weighted = Eigen::VectorXd::Zero(sum.x.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (i == but) continue;
    sum.fisher_information += all[i].fisher_information;
    weighted += all[i].fisher_information * all[i].x;
    Indices both;
    std::set_union(sum.known.begin(), sum.known.end(), all[i].known.begin(), all[i].known.end(),
                   std::back_inserter(both));
    sum.known = std::move(both);
  }
  if (!sum.known.empty()) sum.x(sum.known) = known_covariance(sum) * weighted(sum.known);
  return sum;
}

void store(const ParameterEstimate& e, DriveModel& model) {
  model.covariance.setZero();
  if (e.known.empty()) return;
  const auto n = static_cast<Eigen::Index>(e.known.size());
  Eigen::VectorXd scale(n);
  std::vector<int> at;
  for (const auto i : e.known) {
    const int p = e.parameters[static_cast<std::size_t>(i)];
    const double value = logarithmic(p) ? std::exp(e.x(i)) : e.x(i);
    model = model.moved(p, value - value_of(model, p));
    scale(static_cast<Eigen::Index>(at.size())) = logarithmic(p) ? value : 1.0;
    at.push_back(p);
  }
  model.covariance(at, at) = scale.asDiagonal() * known_covariance(e) * scale.asDiagonal();
}

fit::Consistency distance(const ParameterEstimate& a, const ParameterEstimate& b) {
  Indices both;
  std::set_intersection(a.known.begin(), a.known.end(), b.known.begin(), b.known.end(),
                        std::back_inserter(both));
  if (both.empty()) return {};
  const Indices in_a = places(both, a.known), in_b = places(both, b.known);
  const Eigen::MatrixXd covariance = known_covariance(a)(in_a, in_a) + known_covariance(b)(in_b, in_b);
  const Eigen::VectorXd apart = a.x(both) - b.x(both);
  const double chi_square = apart.dot(inverse(covariance) * apart);
  return {chi_square, static_cast<int>(both.size()), chi_square_tail(chi_square, both.size())};
}

}  // namespace resonid::identification::detail
