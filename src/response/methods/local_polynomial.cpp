// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/response/local_polynomial.hpp>

#include "linalg/decompositions.hpp"
#include "response/signals.hpp"
#include "response/spectra/local_spectra.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;

struct Problem : LocalSpectra {
  int degree = 2;
};

/// One local fit. `response` are G_excitation, G_input, G_output in the centre.
struct Fit {
  Eigen::Vector3cd response = Eigen::Vector3cd::Zero();
  Eigen::Matrix3cd noise = Eigen::Matrix3cd::Zero();  ///< residual covariance per bin
  double gain = 0.0;                                  ///< variance of a response value per noise of 1
  double degrees = 0.0;
  double reference_power = 0.0;  ///< mean over the window
  double left_out_error = 0.0;   ///< |Y - G U|^2 at the centre bin when that bin does not take part
  bool usable = false;
};

Fit fit_around(const Problem& problem, double centre, double half_width) {
  const auto [low, high] = local_window(problem, centre, half_width);
  const Eigen::Index count = high - low + 1;
  const Eigen::Index terms = problem.degree + 1;
  Fit fit;
  fit.degrees = static_cast<double>(count - 2 * terms);
  if (fit.degrees < 2.0) return fit;

  Eigen::MatrixXcd regressors(count, 2 * terms);
  const Eigen::MatrixX3cd measured = problem.spectra.middleRows(low, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double t = (static_cast<double>(low + k) - centre) / half_width;
    double power = 1.0;
    for (Eigen::Index i = 0; i < terms; ++i, power *= t) {
      regressors(k, i) = power * measured(k, problem.reference);
      regressors(k, terms + i) = power;
    }
  }
  // Scaled columns: excitation and transient may differ by orders of magnitude.
  const Eigen::RowVectorXd scale = regressors.colwise().norm();
  if (!(scale.minCoeff() > 0.0)) return fit;
  regressors = regressors * scale.cwiseInverse().asDiagonal();
  // Scaled and centred, the normal equations lose few digits, and they cost least.
  const Eigen::MatrixXcd gram = regressors.adjoint() * regressors;
  const linalg::ComplexLdlt solver(gram);
  if (!solver.succeeded() || !(solver.rcond() > 1e-11)) return fit;
  const Eigen::MatrixX3cd solution = solver.solve(regressors.adjoint() * measured);
  const Eigen::MatrixX3cd residual = measured - regressors * solution;
  fit.response = solution.row(0).transpose() / scale(0);
  fit.noise = (residual.transpose() * residual.conjugate()) / fit.degrees;
  const Eigen::VectorXcd first = solver.solve(Eigen::VectorXcd::Unit(2 * terms, 0));
  fit.gain = first(0).real() / (scale(0) * scale(0));
  fit.reference_power = measured.col(problem.reference).squaredNorm() / static_cast<double>(count);
  const auto middle = std::clamp<Eigen::Index>(std::lround(centre) - low, 0, count - 1);
  const double leverage =
      (regressors.row(middle) * solver.solve(regressors.row(middle).adjoint())).value().real();
  const Complex ratio = fit.response(2) / fit.response(1);
  const Complex error = residual(middle, 2) - (problem.reference == 1 ? 0.0 : ratio) * residual(middle, 1);
  fit.left_out_error = std::norm(error) / std::pow(std::max(1.0 - leverage, 1e-6), 2);
  fit.usable = true;
  return fit;
}

/// Noise of Y - G U per bin, from the residuals.
double output_noise(const Fit& fit, const Problem& problem) {
  const Complex ratio = problem.reference == 1 ? 0.0 : fit.response(2) / fit.response(1);
  const Eigen::RowVector3cd row(0.0, -ratio, 1.0);
  return (row * fit.noise * row.adjoint()).value().real();
}

/// Leave-one-out choice of the half width over the bins of the band that will be reported.
std::size_t choose_half_width(const Problem& problem, const std::vector<double>& frequencies_hz) {
  const double widest = 0.25 * static_cast<double>(problem.spectra.rows());
  std::vector<double> candidates;
  for (double width = 5.0 * (problem.degree + 1); candidates.empty() || width <= std::min(widest, 600.0);
       width *= 1.25)
    candidates.push_back(std::round(width));
  const double first = std::ceil(frequencies_hz.front() / problem.spacing_hz);
  const double last = std::max(first, std::floor(frequencies_hz.back() / problem.spacing_hz));
  std::vector<double> centres;
  for (double bin = first; bin <= last; bin += std::max(1.0, std::ceil((last - first) / 600.0)))
    centres.push_back(bin);
  std::vector<double> scores;
  std::vector<double> noise(centres.size(), 0.0);  // of the first usable, narrowest fit
  for (const double width : candidates) {
    double score = 0.0;
    for (std::size_t i = 0; i < centres.size(); ++i) {
      const Fit fit = fit_around(problem, centres[i], width);
      if (fit.usable && noise[i] == 0.0) noise[i] = output_noise(fit, problem);
      // Bounded: a line that is lost with one width must not decide for all others.
      score += fit.usable && noise[i] > 0.0 ? std::min(fit.left_out_error / noise[i], 10.0) : 10.0;
    }
    scores.push_back(score);
    if (score > 1.5 * *std::min_element(scores.begin(), scores.end())) break;  // bias has taken over
  }
  const double limit = 1.01 * *std::min_element(scores.begin(), scores.end());
  std::size_t best = scores.size();
  while (scores[--best] > limit) continue;
  return static_cast<std::size_t>(candidates[best]);
}

LineEstimate estimate(const Fit& fit, double frequency_hz) {
  LineEstimate line;
  line.frequency_hz = frequency_hz;
  line.excitation = fit.response(0);
  line.input = fit.response(1);
  line.output = fit.response(2);
  line.covariance = fit.gain * fit.noise;
  line.degrees_of_freedom = fit.degrees;
  const double explained = std::norm(fit.response(2)) * fit.reference_power;
  line.coherence = explained / (explained + fit.noise(2, 2).real());
  return line;
}

}  // namespace

expected<LineEstimates, Error> local_polynomial_lines(const data::Record& record,
                                                      const LocalPolynomialConfig& config,
                                                      Approach approach) {
  if (const auto difference = differenced(record))
    return local_polynomial_lines(*difference, config, approach).map(integrated);
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  if (config.degree < 0 || config.degree > 6) return refuse("degree", "must lie in 0 ... 6", config.degree);
  auto spectra = local_spectra(record, *signals, approach);
  if (!spectra) return unexpected(spectra.error());
  const Problem problem{*std::move(spectra), config.degree};
  const auto frequencies =
      local_grid(record, problem, {config.frequencies_hz, config.band_low_hz, config.band_high_hz});
  if (!frequencies) return unexpected(frequencies.error());
  const std::size_t half_width =
      config.half_width_bins > 0 ? config.half_width_bins : choose_half_width(problem, *frequencies);
  if (2 * half_width + 1 < static_cast<std::size_t>(2 * config.degree + 4))
    return refuse("half_width_bins", "must leave at least two degrees of freedom",
                  static_cast<double>(half_width));

  LineEstimates estimates = empty_estimates(record, *signals);
  estimates.has_excitation = estimates.has_excitation && approach != Approach::direct;
  for (const double f : *frequencies) {
    const Fit fit = fit_around(problem, f / problem.spacing_hz, static_cast<double>(half_width));
    if (fit.usable) estimates.lines.push_back(estimate(fit, f));
  }
  return estimates;
}

expected<data::FrequencyResponse, Error> local_polynomial(const data::Record& record,
                                                          const LocalPolynomialConfig& config,
                                                          const ResponseOptions& options) {
  return local_polynomial_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
