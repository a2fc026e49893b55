// SPDX-License-Identifier: MIT
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <resonid/response/detail/local_rational.hpp>
#include <utility>

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

/// The equations y A = r B + T of one window, rows divided by A: columns are the signals (r, 1, -y) times
/// powers of the distance from the centre. The instruments are the same of noise-free signals, so that every
/// entry of Z'X is a moment of one of nine products of two signals.
class Equations {
 public:
  Equations(const Problem& problem, const Eigen::MatrixXd& powers, const Column& input,
            const Column& instrument, const Column& output)
      : counts_{problem.degree + 1, problem.transient_degree + 1, problem.degree},
        powers_(powers),
        input_(input),
        instrument_(instrument),
        output_(output),
        products_(input.size(), 2 * kProducts) {
    put(0, instrument);
    put(1, Column::Ones(input.size()));
    products_.col(2 * kSquares) = instrument.cwiseAbs2();
    products_.col(2 * kSquares + 1).setZero();
  }

  /// For these noise-free outputs and A; false where a column vanishes.
  bool set(const Column& noise_free, const Column& denominator) {
    noise_free_ = noise_free;
    denominator_ = denominator;
    put(2, -noise_free);
    products_.col(2 * kSquares + 1) = noise_free.cwiseAbs2();
    const Eigen::Index sums = 2 * std::max(counts_[0], counts_[1]) - 1;
    const Eigen::MatrixXd moments = powers_.leftCols(sums).transpose() *
                                    (denominator.cwiseAbs2().cwiseInverse().asDiagonal() * products_);
    const auto moment = [&](int z, int x, Eigen::Index power) {
      return Complex{moments(power, 2 * (3 * z + x)), moments(power, 2 * (3 * z + x) + 1)};
    };
    scale.resize(parameters());
    each_column([&](int signal, Eigen::Index power, Eigen::Index at) {
      const Eigen::Index square = signal == 1 ? 2 * 4 : 2 * kSquares + signal / 2;
      scale(at) = std::sqrt(moments(2 * power, square));
    });
    if (!(scale.minCoeff() > 0.0) || !scale.allFinite()) return false;
    matrix.resize(parameters(), parameters());
    right.resize(parameters());
    each_column([&](int z, Eigen::Index p, Eigen::Index row) {
      right(row) = -moment(z, 2, p) / scale(row);
      each_column([&](int x, Eigen::Index q, Eigen::Index column) {
        matrix(row, column) = moment(z, x, p + q) / (scale(row) * scale(column));
      });
    });
    return true;
  }

  /// What the rows of a solution (scaled) make of the noise in every bin.
  [[nodiscard]] Column weights(const Eigen::VectorXcd& row) const {
    const Eigen::VectorXcd by = row.conjugate().cwiseQuotient(scale.cast<Complex>());
    const auto polynomial = [&](int signal) -> Column {
      return powers_.middleCols(first(signal), counts_[signal]) * by.segment(offset(signal), counts_[signal]);
    };
    return (instrument_.cwiseProduct(polynomial(0)) + polynomial(1) - noise_free_.cwiseProduct(polynomial(2)))
        .cwiseQuotient(denominator_);
  }

  /// Weight of one bin upon its own fit.
  [[nodiscard]] double leverage(Eigen::Index bin, const Eigen::MatrixXcd& inverse) const {
    Eigen::RowVectorXcd x(parameters()), z(parameters());
    each_column([&](int signal, Eigen::Index power, Eigen::Index at) {
      const Complex by = powers_(bin, power) / (denominator_(bin) * scale(at));
      const std::array<Complex, 3> of_x{input_(bin), 1.0, -output_(bin)},
          of_z{instrument_(bin), 1.0, -noise_free_(bin)};
      x(at) = of_x[static_cast<std::size_t>(signal)] * by;
      z(at) = of_z[static_cast<std::size_t>(signal)] * by;
    });
    return (x * inverse * z.adjoint()).value().real();
  }

  Eigen::MatrixXcd matrix;  ///< Z'X, with columns of Z of length one.
  Eigen::VectorXcd right;   ///< Z'y
  Eigen::VectorXd scale;    ///< Lengths of the columns of Z.

 private:
  static constexpr Eigen::Index kSquares = 9, kProducts = 10;

  [[nodiscard]] Eigen::Index parameters() const { return counts_[0] + counts_[1] + counts_[2]; }
  [[nodiscard]] static Eigen::Index first(int signal) { return signal == 2 ? 1 : 0; }
  [[nodiscard]] Eigen::Index offset(int signal) const {
    return (signal > 0 ? counts_[0] : 0) + (signal > 1 ? counts_[1] : 0);
  }
  void each_column(const auto& with) const {
    for (int signal = 0; signal < 3; ++signal)
      for (Eigen::Index k = 0; k < counts_[signal]; ++k) with(signal, first(signal) + k, offset(signal) + k);
  }
  /// The products of an instrument with the three signals.
  void put(int z, const Column& instrument) {
    const auto store = [&](int x, const auto& product) {
      products_.col(2 * (3 * z + x)) = product.real();
      products_.col(2 * (3 * z + x) + 1) = product.imag();
    };
    store(0, instrument.conjugate().cwiseProduct(input_));
    store(1, instrument.conjugate());
    store(2, -instrument.conjugate().cwiseProduct(output_));
  }

  std::array<Eigen::Index, 3> counts_;
  const Eigen::MatrixXd& powers_;
  const Column &input_, &instrument_, &output_;
  Column noise_free_, denominator_;
  Eigen::MatrixXd products_;  ///< [bin, real and imaginary part of the product of two signals]
};

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
  Equations equations(problem, powers, input, instrument, output);
  Column denominator = Column::Ones(count), last_free, last_denominator;
  double least = std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    if (!equations.set(noise_free, denominator)) break;
    const linalg::ComplexLu solver(equations.matrix);
    if (!(solver.rcond() > 1e-17)) break;  // pole and zero may cancel: any solution is right then
    const Eigen::VectorXcd solution =
        solver.solve(equations.right).cwiseQuotient(equations.scale.cast<Complex>());
    if (!solution.allFinite()) break;
    const Column before =
        std::exchange(denominator, Column::Ones(count) + powers.middleCols(1, b - 1) * solution.tail(b - 1));
    const Column forced = powers.leftCols(b) * solution.head(b);
    const Column transient = powers.leftCols(t) * solution.segment(b, t);
    Column noise = output - (forced.cwiseProduct(input) + transient).cwiseQuotient(denominator);
    const double power = noise.squaredNorm();
    if (!std::isfinite(power)) break;
    if (power > 1.05 * least) break;  // began to diverge
    least = std::min(power, least);
    ratio.value = solution(0);
    ratio.noise = std::move(noise);
    ratio.variance = power / ratio.degrees;
    last_denominator = before;
    last_free =
        std::exchange(noise_free, (forced.cwiseProduct(instrument) + transient).cwiseQuotient(denominator));
    ratio.fitted = noise_free;
    ratio.usable = true;
  }
  if (!ratio.usable) return ratio;
  equations.set(last_free, last_denominator);
  const Eigen::MatrixXcd inverse = linalg::ComplexLu(equations.matrix).inverse();
  ratio.weights = equations.weights(inverse.row(0).transpose() / equations.scale(0));
  ratio.leverage = equations.leverage(centre_bin, inverse);
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
  const auto powers = powers_of(low, count, centre, half_width,
                                std::max({4, 2 * problem.degree, 2 * problem.transient_degree}));
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
