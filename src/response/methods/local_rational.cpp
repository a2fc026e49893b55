// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/response/detail/local_rational.hpp>

#include "linalg/decompositions.hpp"
#include "response/signals.hpp"
#include "response/spectra/local_spectra.hpp"

namespace resonid::response {
namespace {

using Complex = std::complex<double>;
using Column = Eigen::VectorXcd;  // [bin of the window]
constexpr int kRounds = 6;

struct Problem : LocalSpectra {
  int degree = 2;
  int transient_degree = 2;

  [[nodiscard]] Eigen::Index parameters() const { return 2 * degree + transient_degree + 2; }
};

/// Value in the centre of one response, and how it hangs on the noise of the window's bins.
struct Ratio {
  Complex value;
  Column weights;         ///< error = weights' noise: the first row of (Z'X)^-1 Z';
  Column noise;           ///< [bin] measured less fitted output
  Column fitted;          ///< [bin] noise-free output
  double variance = 0.0;  ///< of the noise, per bin
  double leverage = 0.0;  ///< of the centre bin upon its own fit
  double degrees = 0.0;
  bool usable = false;
};

/// Powers of the distance from the centre: [bin, power].
Eigen::MatrixXd powers_of(Eigen::Index first, Eigen::Index count, double centre, double half_width,
                          int degree) {
  Eigen::MatrixXd powers(count, degree + 1);
  for (Eigen::Index k = 0; k < count; ++k) {
    const double t = (static_cast<double>(first + k) - centre) / half_width;
    double power = 1.0;
    for (Eigen::Index i = 0; i <= degree; ++i, power *= t) powers(k, i) = power;
  }
  return powers;
}

/// Columns B, T and -A (without its 1) of A x = B r + T, rows divided by A.
Eigen::MatrixXcd regressors(const Problem& problem, const Eigen::MatrixXd& powers, const Column& input,
                            const Column& output, const Column& denominator) {
  const Eigen::Index b = problem.degree + 1;
  const Eigen::Index t = problem.transient_degree + 1;
  Eigen::MatrixXcd columns(input.size(), problem.parameters());
  columns.leftCols(b) = input.asDiagonal() * powers.leftCols(b).cast<Complex>();
  columns.middleCols(b, t) = powers.leftCols(t).cast<Complex>();
  columns.rightCols(b - 1) = output.asDiagonal() * (-powers.middleCols(1, b - 1)).cast<Complex>();
  return denominator.cwiseInverse().asDiagonal() * columns;
}

/// The part of a signal that a local polynomial makes of the reference: first instrument.
Column smoothed(const Eigen::MatrixXd& powers, const Column& reference, const Column& signal) {
  constexpr Eigen::Index kTerms = 5;
  Eigen::MatrixXcd columns(signal.size(), 2 * kTerms);
  columns.leftCols(kTerms) = reference.asDiagonal() * powers.leftCols(kTerms).cast<Complex>();
  columns.rightCols(kTerms) = powers.leftCols(kTerms).cast<Complex>();
  const Eigen::RowVectorXd scale = columns.colwise().norm().cwiseMax(1e-300);
  columns = columns * scale.cwiseInverse().asDiagonal();
  return columns * linalg::ComplexLdlt(columns.adjoint() * columns).solve(columns.adjoint() * signal);
}

/// Refined instrumental variables; `instrument` and `noise_free` are the noise-free parts of input and
/// output.
Ratio fit_ratio(const Problem& problem, const Eigen::MatrixXd& powers, const Column& input,
                const Column& instrument, const Column& output, Column noise_free, Eigen::Index centre_bin) {
  const Eigen::Index count = input.size();
  const Eigen::Index b = problem.degree + 1;
  const Eigen::Index t = problem.transient_degree + 1;
  Ratio ratio;
  ratio.degrees = static_cast<double>(count - problem.parameters());
  if (ratio.degrees < 4.0) return ratio;
  Column denominator = Column::Ones(count);
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXcd x = regressors(problem, powers, input, output, denominator);
    Eigen::MatrixXcd z = regressors(problem, powers, instrument, noise_free, denominator);
    const Eigen::RowVectorXd scale = z.colwise().norm();
    if (!(scale.minCoeff() > 0.0) || !scale.allFinite()) break;
    x = x * scale.cwiseInverse().asDiagonal();
    z = z * scale.cwiseInverse().asDiagonal();
    const linalg::ComplexLu solver(z.adjoint() * x);
    if (!(solver.rcond() > 1e-17)) break;  // pole and zero may cancel: any solution is right then
    Eigen::VectorXcd solution = solver.solve(z.adjoint() * output.cwiseQuotient(denominator));
    solution = solution.cwiseQuotient(scale.transpose().cast<Complex>());
    if (!solution.allFinite()) break;
    denominator = Column::Ones(count) + powers.middleCols(1, b - 1) * solution.tail(b - 1);
    const Column forced = powers.leftCols(b) * solution.head(b);
    const Column transient = powers.leftCols(t) * solution.segment(b, t);
    const Column noise = (output - (forced.cwiseProduct(input) + transient).cwiseQuotient(denominator));
    noise_free = (forced.cwiseProduct(instrument) + transient).cwiseQuotient(denominator);
    const double power = noise.squaredNorm();
    if (!std::isfinite(power)) break;
    if (power > 1.05 * least) break;  // began to diverge
    least = std::min(power, least);
    ratio.value = solution(0);
    ratio.noise = noise;
    ratio.fitted = noise_free;
    ratio.variance = power / ratio.degrees;
    const Eigen::MatrixXcd inverse = solver.inverse();
    ratio.weights = z * inverse.row(0).adjoint() / scale(0);
    ratio.leverage = (x.row(centre_bin) * inverse * z.row(centre_bin).adjoint()).value().real();
    ratio.usable = true;
  }
  return ratio;
}

/// The fits of one window: input and output from the reference, or the output from the input.
struct Window {
  Ratio input;
  Ratio output;        ///< joint and direct: per input; indirect: per excitation
  double power = 0.0;  ///< mean square of what the output is referred to
  Eigen::Index first = 0;
  bool usable = false;
};

Window fit_window(const Problem& problem, Approach approach, bool has_input, double centre,
                  double half_width) {
  const auto [low, high] = local_window(problem, centre, half_width);
  const Eigen::Index count = high - low + 1;
  Window window;
  window.first = low;
  if (count <= problem.parameters() + 4) return window;
  const auto powers =
      powers_of(low, count, centre, half_width, std::max({4, problem.degree, problem.transient_degree}));
  const auto middle = std::clamp<Eigen::Index>(std::lround(centre) - low, 0, count - 1);
  const Column excitation = problem.spectra.col(0).segment(low, count);
  const Column input = problem.spectra.col(1).segment(low, count);
  const Column output = problem.spectra.col(2).segment(low, count);
  const Column& basis = approach == Approach::direct ? input : excitation;
  const auto ratio = [&](const Column& from, const Column& instrument, const Column& to) {
    return fit_ratio(problem, powers, from, instrument, to, smoothed(powers, basis, to), middle);
  };
  if (approach != Approach::direct && has_input) {
    window.input = ratio(excitation, excitation, input);
    if (!window.input.usable) return window;
  }
  const bool joint = approach == Approach::joint;
  const Column& reference = approach == Approach::indirect ? excitation : input;
  window.output = ratio(reference, joint ? window.input.fitted : reference, output);
  window.power = reference.squaredNorm() / static_cast<double>(count);
  window.usable = window.output.usable;
  return window;
}

/// |Y - fitted|^2 at the centre bin when that bin does not take part.
double left_out_error(const Window& window, double centre) {
  const auto middle =
      std::clamp<Eigen::Index>(std::lround(centre) - window.first, 0, window.output.noise.size() - 1);
  return std::norm(window.output.noise(middle)) / std::pow(std::max(1.0 - window.output.leverage, 1e-6), 2);
}

/// Leave-one-out choice of the half width.
std::size_t choose_half_width(const Problem& problem, Approach approach, bool has_input,
                              const std::vector<double>& frequencies_hz) {
  // Wider, more than one mode may lie in a window.
  const double widest = 0.25 * (problem.last_excited - problem.first_excited);
  std::vector<double> candidates;
  for (double width = 4.0 * static_cast<double>(problem.parameters());
       candidates.empty() || width <= std::min(widest, 800.0); width *= 1.5)
    candidates.push_back(std::round(width));
  const double first = std::ceil(frequencies_hz.front() / problem.spacing_hz);
  const double last = std::max(first, std::floor(frequencies_hz.back() / problem.spacing_hz));
  std::vector<double> centres;
  for (double bin = first; bin <= last; bin += std::max(1.0, std::ceil((last - first) / 150.0)))
    centres.push_back(bin);
  // Mean logarithm of the left-out errors: free of scale, and no line that is lost decides for all others.
  std::vector<double> scores;
  for (const double width : candidates) {
    double score = 0.0;
    for (const double centre : centres) {
      const Window window = fit_window(problem, approach, has_input, centre, width);
      const double floor = 1e-12 * std::norm(window.usable ? window.output.value : 1.0) * window.power;
      const double error = window.usable ? left_out_error(window, centre) : 1e300;
      score += std::log(std::max(error, floor) + 1e-300) / static_cast<double>(centres.size());
    }
    scores.push_back(score);
    if (score > 0.5 + *std::min_element(scores.begin(), scores.end())) break;  // bias has taken over
  }
  const double limit = 0.03 + *std::min_element(scores.begin(), scores.end());
  std::size_t best = scores.size();
  while (scores[--best] > limit) continue;
  return static_cast<std::size_t>(candidates[best]);
}

LineEstimate estimate(const Window& window, Approach approach, bool has_input, double frequency_hz) {
  LineEstimate line;
  line.frequency_hz = frequency_hz;
  line.degrees_of_freedom = window.output.degrees;
  const auto product = [](const Ratio& a, const Ratio& b) -> Complex {  // E{error of a, conjugate error of b}
    const Complex noise = b.noise.dot(a.noise) / std::sqrt(a.degrees * b.degrees);
    return noise * b.weights.dot(a.weights);
  };
  const Complex g = window.output.value;
  const double own = product(window.output, window.output).real();
  if (approach == Approach::direct) {
    line.input = 1.0;
    line.output = g;
    line.covariance(2, 2) = own;
  } else {
    line.excitation = 1.0;
    line.output = g;
    line.covariance(2, 2) = own;
    if (has_input) {
      const Complex s = window.input.value;
      const double input = product(window.input, window.input).real();
      const Complex cross = product(window.output, window.input);
      line.input = s;
      line.covariance(1, 1) = input;
      line.covariance(2, 1) = cross;
      if (approach == Approach::joint) {  // Y = G U
        line.output = g * s;
        line.covariance(2, 1) = g * input + s * cross;
        line.covariance(2, 2) =
            std::norm(g) * input + std::norm(s) * own + 2.0 * (s * std::conj(g) * cross).real();
      }
      line.covariance(1, 2) = std::conj(line.covariance(2, 1));
    }
  }
  const double explained = std::norm(g) * window.power;
  line.coherence = explained / (explained + window.output.variance);
  return line;
}

/// Correlation of the errors of two lines whose windows overlap, from the middle of the grid outwards.
data::LineCorrelation correlation_of(const std::vector<Window>& windows, double spacing_hz, double half_width,
                                     const std::vector<double>& centres) {
  data::LineCorrelation correlation{{0.0}, {1.0}};
  constexpr int kSteps = 20;
  std::vector<double> sum(kSteps + 1, 0.0), count(kSteps + 1, 0.0);
  const double step = 2.0 * half_width / kSteps;
  for (std::size_t i = 0; i < windows.size(); ++i)
    for (std::size_t k = i + 1; k < windows.size(); ++k) {
      const auto distance = static_cast<std::size_t>(std::lround((centres[k] - centres[i]) / step));
      if (distance == 0) continue;
      if (distance > kSteps) break;
      const Column &a = windows[i].output.weights, &b = windows[k].output.weights;
      const Eigen::Index shift = windows[k].first - windows[i].first;
      const Eigen::Index common = std::min(a.size() - shift, b.size());
      if (shift < 0 || common <= 0) continue;
      sum[distance] += a.segment(shift, common).dot(b.head(common)).real() / (a.norm() * b.norm());
      count[distance] += 1.0;
    }
  for (std::size_t d = 1; d <= kSteps; ++d) {
    if (count[d] == 0.0) continue;
    correlation.distance_hz.push_back(static_cast<double>(d) * step * spacing_hz);
    correlation.value.push_back(sum[d] / count[d]);
  }
  correlation.distance_hz.push_back((2.0 * half_width + step) * spacing_hz);
  correlation.value.push_back(0.0);
  return correlation;
}

}  // namespace

expected<LineEstimates, Error> local_rational_lines(const data::Record& record,
                                                    const LocalRationalConfig& config, Approach approach) {
  if (const auto difference = differenced(record))
    return local_rational_lines(*difference, config, approach).map(integrated);
  const auto signals = signals_of(record, approach);
  if (!signals) return unexpected(signals.error());
  if (config.degree < 1 || config.degree > 4) return refuse("degree", "must lie in 1 ... 4", config.degree);
  if (config.transient_degree < 0 || config.transient_degree > 6)
    return refuse("transient_degree", "must lie in 0 ... 6", config.transient_degree);
  auto spectra = local_spectra(record, *signals, approach);
  if (!spectra) return unexpected(spectra.error());
  const Problem problem{*std::move(spectra), config.degree, config.transient_degree};
  const auto frequencies =
      local_grid(record, problem, {config.frequencies_hz, config.band_low_hz, config.band_high_hz});
  if (!frequencies) return unexpected(frequencies.error());
  const bool has_input = signals->has(1);
  const std::size_t half_width = config.half_width_bins > 0
                                     ? config.half_width_bins
                                     : choose_half_width(problem, approach, has_input, *frequencies);
  if (2 * half_width + 1 < static_cast<std::size_t>(problem.parameters() + 4))
    return refuse("half_width_bins", "must leave at least four degrees of freedom",
                  static_cast<double>(half_width));

  LineEstimates estimates = empty_estimates(record, *signals);
  estimates.has_excitation = estimates.has_excitation && approach != Approach::direct;
  std::vector<Window> windows;
  std::vector<double> centres;
  const auto width = static_cast<double>(half_width);
  for (const double f : *frequencies) {
    Window window = fit_window(problem, approach, has_input, f / problem.spacing_hz, width);
    if (!window.usable) continue;
    estimates.lines.push_back(estimate(window, approach, has_input, f));
    centres.push_back(f / problem.spacing_hz);
    windows.push_back(std::move(window));
  }
  estimates.correlation = correlation_of(windows, problem.spacing_hz, width, centres);
  return estimates;
}

expected<data::FrequencyResponse, Error> local_rational(const data::Record& record,
                                                        const LocalRationalConfig& config,
                                                        const ResponseOptions& options) {
  return local_rational_lines(record, config, options.approach).and_then([&](const LineEstimates& lines) {
    return plant_response(lines, options);
  });
}

}  // namespace resonid::response
