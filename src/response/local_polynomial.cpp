// SPDX-License-Identifier: MIT
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <resonid/response/excitation_lines.hpp>
#include <resonid/response/local_polynomial.hpp>
#include <utility>

#include "response/fft.hpp"
#include "response/signals.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
using Spectra = Eigen::MatrixX3cd;  // [bin, excitation input output]

struct Problem {
  Spectra spectra;
  Eigen::Index reference = 0;
  int degree = 2;
  double spacing_hz = 0.0;
  double first_excited = 0.0;  ///< bins between which the reference signal has power
  double last_excited = 0.0;
};

/// Bins of the window around a centre. Bins without excitation tell nothing about the response: what the
/// window has of them at an end of the excited band, it grows by at its other side.
std::pair<Eigen::Index, Eigen::Index> window_of(const Problem& problem, double centre, double half_width) {
  double low = centre - half_width;
  double high = centre + half_width;
  if (centre >= problem.first_excited && centre <= problem.last_excited) {
    const double lacking_below = std::max(problem.first_excited - low, 0.0);
    low -= std::max(high - problem.last_excited, 0.0);
    high += lacking_below;
  }
  const auto last = static_cast<double>(problem.spectra.rows() - 1);
  return {static_cast<Eigen::Index>(std::ceil(std::max(low, 1.0))),
          static_cast<Eigen::Index>(std::floor(std::min(high, last)))};
}

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
  const auto [low, high] = window_of(problem, centre, half_width);
  const Eigen::Index count = high - low + 1;
  const Eigen::Index terms = problem.degree + 1;
  Fit fit;
  fit.degrees = static_cast<double>(count - 2 * terms);
  if (fit.degrees < 2.0) return fit;

  Eigen::MatrixXcd regressors(count, 2 * terms);
  const Spectra measured = problem.spectra.middleRows(low, count);
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
  const Eigen::LDLT<Eigen::MatrixXcd> solver(gram);
  if (solver.info() != Eigen::Success || !(solver.rcond() > 1e-11)) return fit;
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

expected<std::vector<double>, ConfigError> grid(const data::Record& record,
                                                const LocalPolynomialConfig& config,
                                                std::pair<double, double> excited_hz, double spacing_hz) {
  const double nyquist = 0.5 * record.sample_rate_hz;
  for (const double f : config.frequencies_hz)
    if (!(f > 0.0) || f >= nyquist)
      return refuse("frequencies_hz", "must lie between 0 and half the sample rate", f);
  if (!config.frequencies_hz.empty()) {
    auto frequencies = config.frequencies_hz;
    std::sort(frequencies.begin(), frequencies.end());
    return frequencies;
  }
  const auto upper = upper_band_edge(record, config.band_low_hz, config.band_high_hz);
  if (!upper) return unexpected(upper.error());
  double low_hz = config.band_low_hz;
  double high_hz = *upper;
  if (config.band_low_hz == 0.0 && config.band_high_hz == 0.0) {
    low_hz = excited_hz.first;
    high_hz = excited_hz.second;
  }
  const double first = std::max(1.0, std::ceil(low_hz / spacing_hz - 1e-9));
  const double last =
      std::min(std::floor(high_hz / spacing_hz + 1e-9), std::ceil(nyquist / spacing_hz) - 1.0);
  const double step = std::max(1.0, std::ceil((last - first) / 400.0));
  std::vector<double> frequencies;
  for (double bin = first; bin <= last; bin += step) frequencies.push_back(bin * spacing_hz);
  return frequencies;
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

expected<LineEstimates, ConfigError> local_polynomial_lines(const data::Record& record,
                                                            const LocalPolynomialConfig& config,
                                                            Approach approach) {
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  if (config.degree < 0 || config.degree > 6) return refuse("degree", "must lie in 0 ... 6", config.degree);
  const std::size_t length = fast_length(signals->samples);
  if (length < 64) return refuse("record", "must hold at least 64 samples", static_cast<double>(length));

  Problem problem;
  problem.degree = config.degree;
  problem.reference = static_cast<Eigen::Index>(signals->reference);
  problem.spacing_hz = record.sample_rate_hz / static_cast<double>(length);
  problem.spectra = Spectra::Zero(static_cast<Eigen::Index>(length / 2 + 1), 3);
  for (std::size_t i = 0; i < 3; ++i) {
    // Direct: the excitation plays no part, and would make its own ratio look exact.
    if (!signals->has(i) || (i == 0 && approach == Approach::direct)) continue;
    const auto bins = half_spectrum(detrended(signals->signal[i].first(length), trend_degree(record, i)));
    for (std::size_t b = 0; b < bins.size(); ++b)
      problem.spectra(static_cast<Eigen::Index>(b), static_cast<Eigen::Index>(i)) =
          bins[b] / std::sqrt(static_cast<double>(length));
  }
  const auto band = excited_band_hz(record, approach);
  if (!band) return refuse("excitation", "has no power");
  const auto core =
      excited_band_hz(record, approach, 0.25).value_or(*band);  // a chirp is at -6 dB where it ends
  problem.first_excited = core.first / problem.spacing_hz;
  problem.last_excited = core.second / problem.spacing_hz;
  const auto frequencies = grid(record, config, *band, problem.spacing_hz);
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

expected<data::FrequencyResponse, ConfigError> local_polynomial(const data::Record& record,
                                                                const LocalPolynomialConfig& config,
                                                                const ResponseOptions& options) {
  return local_polynomial_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
