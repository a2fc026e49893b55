// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/black_box_result.hpp>
#include <fit/black_box/black_box_search.hpp>
#include <fit/black_box/black_box_signals.hpp>
#include <limits>
#include <numeric>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/black_box.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>

namespace resonid::fit {
namespace {

using detail::BlackBoxProblem;
using detail::BlackBoxSearch;
using detail::BlackBoxSignals;
using detail::BlackBoxState;
using detail::Recorded;

class Fitter {
 public:
  Fitter(Recorded raw, const BlackBoxConfig& config) : raw_(std::move(raw)), config_(config) {}

  BlackBoxFit run() {
    use(NoiseModel{});
    start();
    const double size = rms(raw_.output);
    const int rounds = !config_.noise_model ? 0 : config_.quick ? 1 : kNoiseRounds;
    for (int round = 0; found_.evaluation.valid && round < rounds; ++round) {
      const auto left = compared(raw_residual());
      if (rms(left) < 1e-9 * size) break;  // what is left is rounding
      const NoiseModel noise = fit_noise_model(left, config_.max_noise_order);
      if (noise.order() == 0 && noise_.order() == 0) break;
      const double change = difference(noise, noise_);
      use(noise);
      BlackBoxState state = found_.state;
      state.extra.resize(0);
      found_ = detail::search(*problem_, std::move(state), effort());
      if (change < 1e-3) break;
    }
    return finish();
  }

 private:
  static constexpr int kNoiseRounds = 8;
  static constexpr detail::SearchEffort kExact{60, 1e-13};
  static constexpr detail::SearchEffort kNoisy{60, 1e-10};
  static constexpr detail::SearchEffort kQuick{30, 1e-6};

  void use(const NoiseModel& noise) {
    noise_ = noise;
    signals_ = detail::prepared(raw_, noise, config_);
    problem_ = detail::problem_of(signals_, config_);
  }

  [[nodiscard]] const detail::SearchEffort& effort() const {
    if (config_.quick) return kQuick;
    return config_.noise_model ? kNoisy : kExact;
  }

  /// Those of the record's last samples that are not hold-out data.
  [[nodiscard]] std::vector<double> compared(std::vector<double> x) const {
    if (raw_.unused.empty()) return x;
    const std::size_t first = raw_.unused.size() - x.size();
    std::size_t kept = 0;
    for (std::size_t k = 0; k < x.size(); ++k)
      if (!raw_.unused[first + k]) x[kept++] = x[k];
    x.resize(kept);
    return x;
  }

  /// The pole nearest to 1; of a complex pair the other one becomes real.
  static void drop_integrator(std::vector<std::complex<double>>& poles) {
    const auto nearest = std::min_element(poles.begin(), poles.end(), [](const auto& x, const auto& y) {
      return std::abs(x - 1.0) < std::abs(y - 1.0);
    });
    const auto dropped = *nearest;
    poles.erase(nearest);
    if (dropped.imag() == 0.0) return;
    const auto other = std::min_element(poles.begin(), poles.end(), [&](const auto& x, const auto& y) {
      return std::abs(x - std::conj(dropped)) < std::abs(y - std::conj(dropped));
    });
    if (other != poles.end()) *other = std::clamp(std::abs(*other), 0.0, 0.999);
  }

  /// Poles of the given model without the fixed integrator's.
  [[nodiscard]] std::vector<std::complex<double>> given_poles() const {
    auto poles = config_.initial->poles();
    if (config_.integrator && !poles.empty()) drop_integrator(poles);
    poles.resize(static_cast<std::size_t>(problem_->layout().order), 0.0);
    return poles;
  }

  /// The model that was given; its poles alone and rest at zero when its order is lower.
  [[nodiscard]] BlackBoxState given_state() const {
    const auto& r = config_.start;
    const auto& layout = problem_->layout();
    if (r.output.size() == layout.order && r.taps.size() == layout.taps && r.integrator == layout.integrator)
      return {{r.transition, r.input}, r.output, r.taps, {}};
    const Eigen::VectorXcd of_start = detail::Realisation{r.transition, r.input}.poles();
    std::vector<std::complex<double>> poles(of_start.begin(), of_start.end());
    if (r.integrator && !layout.integrator) poles.emplace_back(1.0);
    if (!r.integrator && layout.integrator && !poles.empty()) drop_integrator(poles);
    poles.resize(static_cast<std::size_t>(layout.order), 0.5);
    return detail::state_with_poles(*problem_, poles);
  }

  void start() {
    if (config_.predictor == Predictor::closed_loop) return start_in_loop();
    if (config_.start.present()) {
      found_ = detail::search_near(*problem_, given_state(), effort());
    } else if (config_.initial) {
      found_ = detail::search_near(*problem_, detail::state_with_poles(*problem_, given_poles()), effort());
    } else {
      found_ = from_scratch(*problem_, signals_);
    }
  }

  /// Looks for a start in the first part of a long record only.
  [[nodiscard]] BlackBoxSearch from_scratch(const BlackBoxProblem& problem,
                                            const BlackBoxSignals& signals) const {
    const std::size_t enough = config_.quick ? 8000 : 20000;
    const bool whole = signals.output.size() < 2 * enough;
    if (whole && signals.instrument.empty()) return detail::search_from_scratch(problem, effort());
    // The instruments' equations have several roots; the one that counts lies near the direct fit.
    BlackBoxSignals part;
    const auto count = static_cast<std::ptrdiff_t>(whole ? signals.output.size() : enough);
    part.input.assign(signals.input.begin(), signals.input.begin() + count);
    part.output.assign(signals.output.begin(), signals.output.begin() + count);
    if (!signals.unused.empty()) part.unused.assign(signals.unused.begin(), signals.unused.begin() + count);
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
    if (config_.start.present()) {
      state = given_state();
      const bool whole =
          state.weights.size() == problem->layout().order && state.taps.size() == problem->layout().taps;
      if (!whole && !problem->evaluate(state, detail::Regressor::model).valid) return;
    } else if (config_.initial) {
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

  BlackBoxFit finish() {
    if (!found_.evaluation.valid) return std::move(fit_);
    const double n = static_cast<double>(problem_->compared());
    const double parameters = static_cast<double>(found_.evaluation.gradient.size());
    const double variance = found_.evaluation.squares / std::max(1.0, n - parameters);
    const auto& layout = problem_->layout();
    const auto parameters_of_model = 2 * layout.order + layout.taps;
    fit_.model = detail::model_of(found_.state, layout, config_,
                                  variance * detail::invert_normal(found_.evaluation.normal)
                                                 .topLeftCorner(parameters_of_model, parameters_of_model));
    fit_.converged = found_.converged;
    fit_.stable = detail::is_stable(fit_.model);
    fit_.samples = problem_->compared();
    fit_.residual = raw_residual();
    fit_.first_sample = raw_.output.size() - fit_.residual.size();
    fit_.noise = noise_;
    fit_.noise.innovation_variance = variance;
    // Per sample of the record: delay and whitening cost some at its start, which must not count.
    const double count =
        static_cast<double>(raw_.output.size() - static_cast<std::size_t>(std::count(
                                                     raw_.unused.begin(), raw_.unused.end(), true)));
    fit_.bic = count * std::log(std::max(found_.evaluation.squares / n, 1e-300)) +
               (parameters + static_cast<double>(noise_.order())) * std::log(count);
    std::vector<bool> seen(raw_.unused);
    seen.resize(raw_.output.size(), false);
    fit_.fit_percent = detail::fit_percent(raw_.output, fit_.residual, seen);
    if (raw_.unused.empty()) return std::move(fit_);
    seen.flip();
    fit_.holdout_fit_percent = detail::fit_percent(raw_.output, fit_.residual, seen);
    BlackBoxState state = found_.state;
    const auto errors = problem_->residual(state);
    fit_.holdout.assign(raw_.output.size(), std::numeric_limits<double>::quiet_NaN());
    for (std::size_t i = 0, k = raw_.output.size() - errors.size(); i < errors.size(); ++i, ++k)
      if (raw_.unused[k]) fit_.holdout[k] = errors[i];
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

expected<BlackBoxFit, Error> fit_black_box(const data::Record& record, const BlackBoxConfig& asked) {
  BlackBoxConfig config = asked;
  if (config.predictor == Predictor::joint && !(config.direct_term && config.delay_samples == 0))
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

expected<std::vector<double>, Error> simulation_residual(const data::Record& record,
                                                         const BlackBoxModel& model,
                                                         const BlackBoxConfig& config) {
  const auto& r = model.realisation;
  BlackBoxConfig same = config;
  same.initial.reset();
  same.start = {};
  same.holdout.clear();
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
