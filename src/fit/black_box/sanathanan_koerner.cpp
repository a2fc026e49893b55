// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/least_squares.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/polynomial.hpp>
#include <resonid/fit/detail/sanathanan_koerner.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;

struct LinearStep {
  Eigen::VectorXd solution;
  Eigen::MatrixXd covariance;
};

/// Least squares with columns scaled to one; covariance for unit variance of the rows. Columns that depend on
/// one another (an order too high) get the shortest solution.
LinearStep solve(const Eigen::MatrixXd& rows, const Eigen::VectorXd& right, bool with_covariance) {
  const Eigen::Index n = rows.cols();
  Eigen::VectorXd scale = rows.colwise().norm().transpose();
  for (Eigen::Index i = 0; i < scale.size(); ++i)
    if (!(scale(i) > 0.0)) scale(i) = 1.0;
  const Eigen::VectorXd inverse_scale = scale.cwiseInverse();
  Eigen::MatrixXd factor(rows.rows(), n + 1);
  factor.leftCols(n).noalias() = rows * inverse_scale.asDiagonal();
  factor.col(n) = right;
  linalg::qr_in_place(factor);
  const auto diagonal = factor.diagonal().head(n).cwiseAbs();
  constexpr double kDependent = 1e-9;
  Eigen::VectorXd solution;
  if (rows.rows() > n && diagonal.minCoeff() > kDependent * diagonal.maxCoeff())
    solution = linalg::solve_upper(factor.topLeftCorner(n, n), factor.col(n).head(n));
  else
    solution = linalg::shortest_solution(rows * inverse_scale.asDiagonal(), right);
  return {inverse_scale.cwiseProduct(solution),
          with_covariance ? detail::inverse_normal_matrix(rows) : Eigen::MatrixXd()};
}

std::vector<data::UndampedMode> modes(const std::vector<Complex>& roots, double sample_time_s) {
  std::vector<data::UndampedMode> result;
  for (const auto& z : roots) {
    if (!(z.imag() > 1e-9 * std::abs(z))) continue;
    const Complex s = std::log(z) / sample_time_s;
    result.push_back({std::abs(s) / kTwoPi, -s.real() / std::abs(s)});
  }
  std::sort(result.begin(), result.end(), [](const data::UndampedMode& a, const data::UndampedMode& b) {
    return a.frequency_hz < b.frequency_hz;
  });
  return result;
}

}  // namespace

expected<RationalFit, Error> fit_sanathanan_koerner(const data::FrequencyResponse& g,
                                                    const SanathananKoernerConfig& config) {
  if (config.order < 1 || config.order > 20) return refuse("order", "must be 1 ... 20", config.order);
  if (config.iterations < 1) return refuse("iterations", "must be at least 1", config.iterations);
  if (!(config.sample_time_s > 0.0)) return refuse("sample_time_s", "must be > 0", config.sample_time_s);
  const int na = config.order - (config.integrator ? 1 : 0);
  const int nb = config.order + (config.direct_term ? 1 : 0);
  const auto lines = static_cast<Eigen::Index>(g.lines());
  if (2 * lines < na + nb)
    return refuse("response", "needs at least half as many lines as parameters", static_cast<double>(lines));
  const bool weighted = g.std.size() == g.lines();

  std::vector<double> a(static_cast<std::size_t>(na) + 1, 0.0);
  a[0] = 1.0;
  std::vector<double> b(static_cast<std::size_t>(config.order) + 1, 0.0);
  LinearStep step;
  std::vector<Complex> delays;  // z^-1 at the lines
  for (const double f : g.frequency_hz) delays.push_back(std::polar(1.0, -kTwoPi * f * config.sample_time_s));
  Eigen::MatrixXd rows(2 * lines, na + nb);
  Eigen::VectorXd right(2 * lines);
  for (int iteration = 0; iteration < config.iterations; ++iteration) {
    for (Eigen::Index i = 0; i < lines; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const Complex inverse_z = delays[k];
      const Complex fixed = config.integrator ? 1.0 - inverse_z : Complex(1.0);
      double weight = weighted ? std::sqrt(2.0) / std::max(g.std[k], 1e-300) : 1.0;
      weight /= std::abs(fixed);
      if (iteration > 0) weight /= std::max(std::abs(polynomial(a, inverse_z)), 1e-12);
      const Complex value = g.value[k] * fixed;
      Complex power = config.direct_term ? Complex(1.0) : inverse_z;
      for (int j = 0; j < nb; ++j, power *= inverse_z) {
        rows(2 * i, j) = weight * power.real();
        rows(2 * i + 1, j) = weight * power.imag();
      }
      power = inverse_z;
      for (int j = 0; j < na; ++j, power *= inverse_z) {
        rows(2 * i, nb + j) = -weight * (power * value).real();
        rows(2 * i + 1, nb + j) = -weight * (power * value).imag();
      }
      right(2 * i) = weight * value.real();
      right(2 * i + 1) = weight * value.imag();
    }
    const bool last = iteration + 1 == config.iterations;
    step = solve(rows, right, last);
    for (int j = 0; j < nb; ++j)
      b[static_cast<std::size_t>(j + (config.direct_term ? 0 : 1))] = step.solution(j);
    for (int j = 0; j < na; ++j) a[static_cast<std::size_t>(j) + 1] = step.solution(nb + j);
    if (last && !weighted) {
      const double free = std::max<double>(1.0, static_cast<double>(2 * lines - na - nb));
      step.covariance *= (rows * step.solution - right).squaredNorm() / free;
    }
  }

  RationalFit fit;
  fit.covariance = step.covariance;
  fit.transfer_function = {b, a, config.sample_time_s};
  if (config.integrator) {
    auto& whole = fit.transfer_function.denominator;
    whole.push_back(0.0);
    for (std::size_t i = whole.size(); i-- > 1;) whole[i] -= whole[i - 1];
  }
  double sum = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double sd = weighted ? std::max(g.std[i], 1e-300) : 1.0;
    sum += std::norm((fit.transfer_function.response(g.frequency_hz[i]) - g.value[i]) / sd);
  }
  fit.misfit = std::sqrt(sum / static_cast<double>(g.lines()));
  const auto poles = fit.transfer_function.poles();
  fit.stable =
      std::all_of(poles.begin(), poles.end(), [](const Complex& p) { return std::abs(p) <= 1.0 + 1e-9; });
  return fit;
}

std::vector<data::UndampedMode> pole_modes(const data::TransferFunction& g) {
  return modes(g.poles(), g.sample_time_s);
}

std::vector<data::UndampedMode> zero_modes(const data::TransferFunction& g) {
  auto numerator = g.numerator;
  while (!numerator.empty() && numerator.front() == 0.0) numerator.erase(numerator.begin());
  if (numerator.size() < 2) return {};
  return modes(data::TransferFunction{{1.0}, numerator, g.sample_time_s}.poles(), g.sample_time_s);
}

}  // namespace resonid::fit
