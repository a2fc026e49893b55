// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box_search.hpp>
#include <fit/black_box_signals.hpp>
#include <numeric>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/controller_estimate.hpp>

namespace resonid::fit {
namespace {

using detail::BlackBoxProblem;
using detail::BlackBoxSearch;
using detail::BlackBoxSignals;
using detail::BlackBoxState;
using detail::Recorded;

double rms(const std::vector<double>& x) {
  const double sum = std::inner_product(x.begin(), x.end(), x.begin(), 0.0);
  return std::sqrt(sum / static_cast<double>(std::max<std::size_t>(x.size(), 1)));
}

bool unstable(const UncertainRoot& pole) {
  constexpr double kRounding = 1e-9, kStandardDeviations = 3.0;
  if (std::abs(pole.value) <= 1.0 + kRounding) return false;
  const std::complex<double> left = pole.value - 1.0;
  const double distance = std::abs(left);
  const Eigen::Vector2d along(left.real() / distance, left.imag() / distance);
  const double variance = along.dot(pole.covariance * along);
  return !(distance <= kStandardDeviations * std::sqrt(std::max(0.0, variance)));
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
    signals_ = detail::prepared(raw_, noise, config_);
    problem_ = detail::problem_of(signals_, config_);
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
    const bool whole = signals.output.size() < 2 * kEnough;
    if (whole && signals.instrument.empty()) return detail::search_from_scratch(problem, effort());
    // The instruments' equations have several roots; the one that counts lies near the direct fit.
    BlackBoxSignals part;
    const auto count = static_cast<std::ptrdiff_t>(whole ? signals.output.size() : kEnough);
    part.input.assign(signals.input.begin(), signals.input.begin() + count);
    part.output.assign(signals.output.begin(), signals.output.begin() + count);
    auto found = detail::search_from_scratch(*detail::open_loop_problem(part, problem.layout()), kNoisy);
    if (!found.evaluation.valid) return found;
    found.state.extra.resize(0);
    return detail::search(problem, std::move(found.state), effort());
  }

  /// The loop's predictor needs a model whose loop is stable: that of the open-loop problem.
  void start_in_loop() {
    BlackBoxConfig open = config_;
    open.predictor = Predictor::open_loop;
    const BlackBoxSignals signals = detail::prepared(raw_, NoiseModel{}, open);
    const auto problem = detail::problem_of(signals, open);
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
    const BlackBoxSignals signals = detail::prepared(raw_, NoiseModel{}, config_);
    return detail::problem_of(signals, config_)->residual(state);
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
    const double variance = found_.evaluation.squares / std::max(1.0, n - parameters);
    store_model(variance);
    fit_.converged = found_.converged;
    const auto poles = fit_.model.poles();
    fit_.stable = std::none_of(poles.begin(), poles.end(), unstable);
    fit_.samples = problem_->samples();
    fit_.residual = raw_residual();
    fit_.first_sample = raw_.output.size() - fit_.residual.size();
    fit_.noise = noise_;
    fit_.noise.innovation_variance = variance;
    fit_.information = n * std::log(std::max(found_.evaluation.squares / n, 1e-300)) +
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

}  // namespace

expected<BlackBoxFit, ConfigError> fit_black_box(const data::Record& record, const BlackBoxConfig& asked) {
  BlackBoxConfig config = asked;
  if (config.predictor == Predictor::joint && !config.direct_term)
    if (auto shown = estimate_controller(record)) {
      config.predictor = Predictor::closed_loop;
      config.controller = std::move(shown->controller);
    }
  auto raw = detail::recorded(record, config);
  if (!raw) return unexpected(raw.error());
  auto fit = Fitter(std::move(*raw), config).run();
  fit.model.transfer_function.sample_time_s = record.sample_time_s();
  return fit;
}

expected<std::vector<double>, ConfigError> simulation_residual(const data::Record& record,
                                                               const BlackBoxModel& model,
                                                               const BlackBoxConfig& config) {
  const auto& r = model.realisation;
  BlackBoxConfig same = config;
  same.initial.reset();
  same.delay_samples = model.delay_samples;
  same.integrator = r.integrator;
  same.direct_term = r.taps.size() > (r.integrator ? 1 : 0);
  same.order = static_cast<int>(r.output.size()) + (r.integrator ? 1 : 0);
  if (!r.present()) return refuse("model", "needs its realisation");
  auto raw = detail::recorded(record, same);
  if (!raw) return unexpected(raw.error());
  const auto signals = detail::prepared(*raw, NoiseModel{}, same);
  const auto problem = detail::problem_of(signals, same);
  BlackBoxState state{{r.transition, r.input}, r.output, r.taps, {}};
  return problem->residual(state);
}

}  // namespace resonid::fit
