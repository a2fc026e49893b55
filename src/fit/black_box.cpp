// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box_search.hpp>
#include <numeric>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/projected_input.hpp>

namespace resonid::fit {
namespace {

using detail::BlackBoxProblem;
using detail::BlackBoxSearch;
using detail::BlackBoxSignals;
using detail::BlackBoxState;

/// The recorded signals that the predictor uses.
struct Recorded {
  std::vector<double> input, output, excitation, reference;
};

std::vector<double> filtered(const std::vector<double>& signal, const NoiseModel& noise) {
  return noise.order() == 0 ? signal : whiten(signal, noise);
}

/// Running sum, one sample late unless the present sample acts at once.
std::vector<double> summed(const std::vector<double>& x, bool at_once) {
  std::vector<double> result(x.size());
  double sum = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (at_once) sum += x[k];
    result[k] = sum;
    if (!at_once) sum += x[k];
  }
  return result;
}

/// Aligned so that input[k] and output[k] belong together. Filtering by the noise model commutes with the
/// plant and the controller, all being linear.
BlackBoxSignals prepared(const Recorded& raw, const NoiseModel& noise, const BlackBoxConfig& config) {
  BlackBoxSignals s;
  s.output = filtered(raw.output, noise);
  if (config.predictor == Predictor::closed_loop) {
    s.excitation = filtered(raw.excitation, noise);
    s.reference = filtered(raw.reference, noise);
    return s;
  }
  s.input = filtered(raw.input, noise);
  if (config.integrator) s.input = summed(s.input, config.direct_term);
  s.input.resize(s.input.size() - config.delay_samples);
  s.output.erase(s.output.begin(), s.output.begin() + static_cast<std::ptrdiff_t>(config.delay_samples));
  return s;
}

detail::BlackBoxLayout layout_of(const BlackBoxConfig& config, bool in_loop) {
  detail::BlackBoxLayout layout;
  layout.order = config.order - (config.integrator ? 1 : 0);
  layout.taps = (config.integrator ? 1 : 0) + (config.direct_term ? 1 : 0);
  layout.initial_state = config.initial_state;
  layout.integrator = config.integrator;
  // A constant torque makes a ramp behind an integrator, whose initial value is a constant.
  layout.constant = config.offset || (config.integrator && config.initial_state);
  layout.ramp = config.integrator && config.offset && !in_loop;
  if (in_loop) {
    layout.delay_samples = config.delay_samples;
    layout.controller = config.controller;
  }
  return layout;
}

double rms(const std::vector<double>& x) {
  const double sum = std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(x.size(), 1)));
}

class Fitter {
 public:
  Fitter(Recorded raw, const BlackBoxConfig& config) : raw_(std::move(raw)), config_(config) {}

  BlackBoxFit run() {
    use(NoiseModel{});
    start();
    const double size = rms(raw_.output);
    for (int round = 0; config_.noise_model && found_.evaluation.valid && round < kNoiseRounds; ++round) {
      const auto left = raw_residual();
      if (rms(left) < 1e-9 * size) break;  // what is left is rounding
      const NoiseModel noise = fit_noise_model(left, config_.max_noise_order);
      if (noise.order() == 0 && noise_.order() == 0) break;
      const double change = difference(noise, noise_);
      use(noise);
      BlackBoxState state = found_.state;
      state.extra.resize(0);
      found_ = detail::search(*problem_, std::move(state), kNoisy);
      if (change < 1e-3) break;
    }
    return finish();
  }

 private:
  static constexpr int kNoiseRounds = 8;
  static constexpr detail::SearchEffort kExact{60, 1e-13};
  static constexpr detail::SearchEffort kNoisy{60, 1e-10};

  void use(const NoiseModel& noise) {
    noise_ = noise;
    signals_ = prepared(raw_, noise, config_);
    const bool in_loop = config_.predictor == Predictor::closed_loop;
    problem_ = in_loop ? detail::closed_loop_problem(signals_, layout_of(config_, true))
                       : detail::open_loop_problem(signals_, layout_of(config_, false));
  }

  [[nodiscard]] const detail::SearchEffort& effort() const { return config_.noise_model ? kNoisy : kExact; }

  /// Poles of the given model without the fixed integrator's.
  [[nodiscard]] std::vector<std::complex<double>> given_poles() const {
    auto poles = config_.initial->poles();
    if (config_.integrator && !poles.empty())
      poles.erase(std::min_element(poles.begin(), poles.end(), [](const auto& a, const auto& b) {
        return std::abs(a - 1.0) < std::abs(b - 1.0);
      }));
    poles.resize(static_cast<std::size_t>(problem_->layout().order), 0.0);
    return poles;
  }

  void start() {
    if (config_.predictor == Predictor::closed_loop) return start_in_loop();
    if (config_.initial) {
      found_ = detail::search_near(*problem_, detail::state_with_poles(*problem_, given_poles()), effort());
    } else {
      found_ = from_scratch(*problem_, signals_);
    }
  }

  /// Looks for a start in the first part of a long record only.
  [[nodiscard]] BlackBoxSearch from_scratch(const BlackBoxProblem& problem,
                                            const BlackBoxSignals& signals) const {
    constexpr std::size_t kEnough = 20000;
    if (signals.output.size() < 2 * kEnough) return detail::search_from_scratch(problem, effort());
    BlackBoxSignals part;
    part.input.assign(signals.input.begin(), signals.input.begin() + kEnough);
    part.output.assign(signals.output.begin(), signals.output.begin() + kEnough);
    auto found = detail::search_from_scratch(*detail::open_loop_problem(part, problem.layout()), kNoisy);
    if (!found.evaluation.valid) return found;
    found.state.extra.resize(0);
    return detail::search(problem, std::move(found.state), effort());
  }

  /// The loop's predictor needs a model whose loop is stable: that of the open-loop problem.
  void start_in_loop() {
    BlackBoxConfig open = config_;
    open.predictor = Predictor::joint;
    const BlackBoxSignals signals = prepared(raw_, NoiseModel{}, open);
    const auto problem = detail::open_loop_problem(signals, layout_of(open, false));
    BlackBoxState state;
    if (config_.initial) {
      state = detail::state_with_poles(*problem, given_poles());
      if (!problem->evaluate(state, detail::Regressor::model).valid) return;
    } else {
      auto found = from_scratch(*problem, signals);
      if (!found.evaluation.valid) return;
      state = std::move(found.state);
    }
    state.extra.resize(0);
    found_ = detail::search(*problem_, std::move(state), effort());
  }

  /// Output minus simulated output, not whitened; the whitened fit's initial state does not belong to it.
  [[nodiscard]] std::vector<double> raw_residual() const {
    BlackBoxState state = found_.state;
    if (noise_.order() == 0) return problem_->residual(state);
    state.extra.resize(0);
    const BlackBoxSignals signals = prepared(raw_, NoiseModel{}, config_);
    const auto problem = config_.predictor == Predictor::closed_loop
                             ? detail::closed_loop_problem(signals, problem_->layout())
                             : detail::open_loop_problem(signals, problem_->layout());
    return problem->residual(state);
  }

  static double difference(const NoiseModel& a, const NoiseModel& b) {
    double sum = 0.0, size = 0.0;
    for (std::size_t i = 0; i < std::max(a.polynomial.size(), b.polynomial.size()); ++i) {
      const double x = i < a.polynomial.size() ? a.polynomial[i] : 0.0;
      const double y = i < b.polynomial.size() ? b.polynomial[i] : 0.0;
      sum += (x - y) * (x - y);
      size += x * x;
    }
    return std::sqrt(sum / size);
  }

  void store_model(double variance) {
    const auto& s = found_.state;
    const auto& layout = problem_->layout();
    const auto n = layout.order, m = layout.taps;
    auto& model = fit_.model;
    model.delay_samples = config_.delay_samples;
    const Eigen::MatrixXd covariance =
        variance * detail::invert_normal(found_.evaluation.normal).topLeftCorner(2 * n + m, 2 * n + m);
    model.realisation = {s.basis.transition, s.basis.input, s.weights, s.taps, layout.integrator, covariance};

    const auto p = detail::polynomials(s.basis);
    // Columns: coefficients of z^-0 ... of numerator and denominator per [alpha, c, h].
    const auto order = static_cast<Eigen::Index>(config_.order);
    Eigen::MatrixXd b = Eigen::MatrixXd::Zero(order + 1, 2 * n + m);
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(order + 1, 2 * n + m);
    const Eigen::Index late = layout.integrator && m == 1 ? 1 : 0;
    for (Eigen::Index i = 0; i < n; ++i) {
      b.col(n + i).segment(1 + late + (m == 2 ? 1 : 0), n) = p.numerators.col(i);
      a.col(i).segment(1, n) = p.numerators.col(i);
    }
    for (Eigen::Index t = 0; t < m; ++t) b.col(2 * n + t).segment(late + t, n + 1) = p.denominator;
    Eigen::VectorXd parameters(2 * n + m);
    parameters << Eigen::VectorXd::Zero(n), s.weights, s.taps;
    const Eigen::VectorXd numerator = b * parameters;
    Eigen::VectorXd denominator = Eigen::VectorXd::Zero(order + 1);
    denominator.head(n + 1) = p.denominator;
    if (layout.integrator) {
      for (Eigen::Index i = order; i > 0; --i) {
        denominator(i) -= denominator(i - 1);
        a.row(i) -= a.row(i - 1).eval();
      }
    }
    model.transfer_function.numerator.assign(numerator.begin(), numerator.end());
    model.transfer_function.denominator.assign(denominator.begin(), denominator.end());
    Eigen::MatrixXd both(2 * order + 1, 2 * n + m);
    both << b, a.bottomRows(order);
    model.covariance = both * covariance * both.transpose();
  }

  BlackBoxFit finish() {
    if (!found_.evaluation.valid) return std::move(fit_);
    const double n = static_cast<double>(problem_->samples());
    const double parameters = static_cast<double>(found_.evaluation.gradient.size());
    const double variance = found_.evaluation.cost / std::max(1.0, n - parameters);
    store_model(variance);
    fit_.converged = found_.converged;
    const auto poles = found_.state.basis.poles();
    fit_.stable = poles.size() == 0 || poles.cwiseAbs().maxCoeff() <= 1.0 + 1e-9;
    fit_.samples = problem_->samples();
    fit_.residual = raw_residual();
    fit_.first_sample = raw_.output.size() - fit_.residual.size();
    fit_.noise = noise_;
    fit_.noise.innovation_variance = variance;
    fit_.information = n * std::log(std::max(found_.evaluation.cost / n, 1e-300)) +
                       (parameters + static_cast<double>(noise_.order())) * std::log(n);
    const auto first = raw_.output.begin() + static_cast<std::ptrdiff_t>(fit_.first_sample);
    const double mean =
        std::accumulate(first, raw_.output.end(), 0.0) / static_cast<double>(fit_.residual.size());
    double total = 0.0;
    for (auto y = first; y != raw_.output.end(); ++y) total += (*y - mean) * (*y - mean);
    const double left = rms(fit_.residual) * std::sqrt(static_cast<double>(fit_.residual.size()));
    fit_.fit_percent = total > 0.0 ? 100.0 * (1.0 - left / std::sqrt(total)) : 0.0;
    return std::move(fit_);
  }

  Recorded raw_;
  const BlackBoxConfig& config_;
  BlackBoxSignals signals_;
  std::unique_ptr<BlackBoxProblem> problem_;
  NoiseModel noise_;
  BlackBoxSearch found_;
  BlackBoxFit fit_;
};

bool usable(const std::vector<double>& x, std::size_t samples) {
  return x.size() == samples && std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

bool varies(const std::vector<double>& x) {
  return std::any_of(x.begin(), x.end(), [&](double v) { return v != x.front(); });
}

expected<Recorded, ConfigError> recorded(const data::Record& record, const BlackBoxConfig& config) {
  const std::size_t n = record.samples();
  Recorded raw{record.input.samples, record.output.samples, {}, {}};
  if (!usable(raw.output, n) || !varies(raw.output))
    return refuse("record", "needs a finite output that varies");
  if (!usable(raw.input, n) || !varies(raw.input))
    return refuse("record", "needs a finite input of the output's length that varies");
  if (config.predictor == Predictor::open_loop) return raw;
  auto projected = projected_input(record);
  if (!projected) return unexpected(projected.error());
  raw.input = std::move(*projected);
  const auto channel = [n](const data::Channel& c) {
    return c.present() ? c.samples : std::vector<double>(n, 0.0);
  };
  raw.excitation = channel(record.excitation);
  raw.reference = channel(record.reference);
  return raw;
}

}  // namespace

expected<BlackBoxFit, ConfigError> fit_black_box(const data::Record& record, const BlackBoxConfig& config) {
  if (config.order < 1 || config.order > 20) return refuse("order", "must be 1 ... 20", config.order);
  if (!(record.sample_rate_hz > 0.0)) return refuse("record", "needs a sample rate", record.sample_rate_hz);
  const auto samples = record.samples();
  if (samples < 50 + 4 * static_cast<std::size_t>(config.order) + config.delay_samples)
    return refuse("record", "needs at least 50 + 4 order + delay samples", static_cast<double>(samples));
  if (config.predictor == Predictor::closed_loop) {
    if (!config.controller || config.controller->numerator.empty() ||
        config.controller->denominator.empty() || config.controller->denominator.front() == 0.0)
      return refuse("controller", "is needed by the closed-loop predictor, with a denominator that starts");
    if (config.direct_term) return refuse("direct_term", "is not possible in a loop");
  }
  if (config.initial) {
    const auto& given = config.initial->denominator;
    if (given.empty() || given.front() == 0.0 || given.size() > static_cast<std::size_t>(config.order) + 1)
      return refuse("initial", "must have at most the model's order");
  }
  auto raw = recorded(record, config);
  if (!raw) return unexpected(raw.error());
  auto fit = Fitter(std::move(*raw), config).run();
  fit.model.transfer_function.sample_time_s = record.sample_time_s();
  return fit;
}

}  // namespace resonid::fit
