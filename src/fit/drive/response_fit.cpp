// SPDX-License-Identifier: MIT
#include <algorithm>
#include <fit/drive/grounded_start.hpp>
#include <fit/drive/initial_models.hpp>
#include <fit/drive/response_cost.hpp>
#include <fit/drive/response_lines.hpp>
#include <fit/drive/score.hpp>
#include <fit/least_squares.hpp>
#include <resonid/fit/response_fit.hpp>

#include "linalg/decompositions.hpp"

namespace resonid::fit {
namespace {

using Complex = std::complex<double>;
using detail::explaining_error;
using detail::known_repetition;
using detail::ResponseCost;
using detail::weights;

std::vector<Complex> as_measured(const data::FrequencyResponse& g, const DriveModel& model) {
  return detail::as_measured(g, model, data::SecondOutput::none);
}

struct Fitter {
  static constexpr detail::Effort kNear{100, 1e-8};  ///< The rounds that follow go on from there.

  const data::FrequencyResponse& lines;
  const ResponseFitConfig& config;

  ResponseFit run(const DriveModel& start, Weighting weighting, double error,
                  const detail::Effort& effort = {}) const {
    ResponseFit fit;
    fit.model = start;
    fit.model.sample_time_s = config.sample_time_s;
    fit.model.known_delay_s = config.known_delay_s;
    fit.model.structure = config.structure;
    fit.model.estimated =
        estimated_parameters(config.structure, config.viscous_friction, config.delay, config.further);
    fit.model_error = error;
    if (!config.viscous_friction) fit.model.parameters.viscous_friction = 0.0;
    if (!config.delay) fit.model.delay_s = 0.0;

    const auto coordinates = coordinates_of(start);
    auto x = coordinates.from(fit.model);
    std::vector<detail::Bound> bounds;
    if (config.delay) bounds.push_back({kDelay, detail::kMinimumDelaySamples, detail::kMaximumDelaySamples});
    const auto& estimated = fit.model.estimated;
    if (estimated[kTorqueLag]) bounds.push_back({kTorqueLag, 0.0, detail::kMaximumLagSamples});
    if (estimated[kOutputFilter]) bounds.push_back({kOutputFilter, 0.0, detail::kMaximumFilterPole});
    const detail::ResponseSetting setting = setting_of(fit.model);
    std::vector<int> active;
    for (int i = 0; i < kParameterCount; ++i)
      if (estimated[static_cast<std::size_t>(i)]) active.push_back(i);
    const auto solution = detail::with_masses(config.structure, [&](auto masses) {
      constexpr int kParameters = detail::Sizes<masses>::kParameters;
      auto cost =
          std::make_unique<ResponseCost<masses>>(lines, weights(lines, weighting, error), points(),
                                                 coordinates, detail::SearchRange(x), setting, active);
      return detail::minimise(std::move(cost), std::span(x).template first<kParameters>(),
                              fit.model.estimated, bounds, effort);
    });
    coordinates.store(x.data(), fit.model);
    fit.converged = solution.converged;
    fit.cost = solution.cost;

    ParameterCovariance covariance = correlated_covariance(solution);
    const double count = static_cast<double>(2 * lines.lines());
    const double free = count - static_cast<double>(solution.active.size());
    if (weighting == Weighting::none && free > 0.0) covariance *= 2.0 * fit.cost / free;
    const auto scale = coordinates.jacobian(fit.model);
    for (int i = 0; i < kParameterCount; ++i)
      for (int j = 0; j < kParameterCount; ++j)
        covariance(i, j) *= scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
    fit.model.covariance = covariance;
    fit.lines = lines.lines();
    fit.parameters = solution.active.size();
    assess(fit);
    return fit;
  }

  [[nodiscard]] detail::ResponseSetting setting_of(const DriveModel& model) const {
    const auto& estimated = model.estimated;
    return {config.sample_time_s, config.known_delay_s / config.sample_time_s,
            estimated[kTorqueLag] || model.torque_lag_s > 0.0 ? detail::Lag::first_order : detail::Lag::none,
            model.grounded() || estimated[kMotorGroundStiffness] || estimated[kLoadGroundStiffness],
            model.velocity};
  }

  /// From a soft weighting towards the data's own: a start far off must not follow its best-measured lines.
  ResponseFit settle(const DriveModel& start) const {
    if (config.weighting != Weighting::model_error) return run(start, config.weighting, 0.0);
    return reweight(run(start, config.weighting, config.initial_error, kNear));
  }

  /// The rounds that follow: the weighting is that of the model error that the last fit leaves.
  ResponseFit reweight(ResponseFit fit) const {
    constexpr double kNothing = 0.99;             // model error: other weights will explain no more
    constexpr detail::Effort kRound{100, 1e-10};  // far below what the likelihood tells apart
    for (int round = 0; round < 12; ++round) {
      const double parameters =
          static_cast<double>(std::count(fit.model.estimated.begin(), fit.model.estimated.end(), true));
      const double free = std::max(0.1, 1.0 - parameters / static_cast<double>(2 * lines.lines()));
      const double error = explaining_error(lines, as_measured(lines, fit.model), free,
                                            static_cast<double>(lines.lines()) / known_repetition(lines));
      if (error > kNothing) break;
      const double before = fit.model_error;
      fit = run(fit.model, Weighting::model_error, error, kRound);
      if (std::abs(error - before) <= 1e-3 * before + 1e-9) break;
    }
    return fit;
  }

  /// Lagrange multiplier tests, as those of the fits to records.
  [[nodiscard]] std::vector<Lacking> lacking(const ResponseFit& fit) const {
    DriveModel model = fit.model;
    std::vector<int> columns;
    for (int i = 0; i < kParameterCount; ++i)
      if (model.estimated[static_cast<std::size_t>(i)]) columns.push_back(i);
    const auto estimated = static_cast<Eigen::Index>(columns.size());
    std::vector<Lacking> found;
    for (const Parameter p : detail::kFurtherTried)
      if (!model.estimated[static_cast<std::size_t>(p)] && may_have_parameter(config.structure, p)) {
        columns.push_back(p);
        found.push_back({p, 0.0});
      }
    const auto coordinates = coordinates_of(model);
    const auto x = coordinates.from(model);
    auto setting = setting_of(model);
    setting.lag = detail::Lag::first_order;
    setting.grounded = true;
    const auto rows = static_cast<Eigen::Index>(2 * lines.lines());
    Eigen::VectorXd residual(rows);
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> slopes;
    const bool done = detail::with_masses(config.structure, [&](auto masses) {
      slopes.resize(rows, detail::Sizes<masses>::kParameters);
      const ResponseCost<masses> cost(lines, weights(lines, config.weighting, fit.model_error), points(),
                                      coordinates, detail::SearchRange(x), setting, columns);
      const double* block = x.data();
      double* jacobian = slopes.data();
      return cost.Evaluate(&block, residual.data(), &jacobian);
    });
    if (!done) return {};
    Eigen::MatrixXd all(rows, static_cast<Eigen::Index>(columns.size()) + 1);
    for (Eigen::Index i = 0; i + 1 < all.cols(); ++i)
      all.col(i) = slopes.col(columns[static_cast<std::size_t>(i)]);
    all.rightCols(1) = residual;
    detail::score(linalg::upper_factor(all), estimated,
                  2.0 * fit.cost / static_cast<double>(std::max<Eigen::Index>(1, rows - estimated)), found);
    return found;
  }

  [[nodiscard]] std::vector<detail::Points> points() const {
    return detail::points_of(lines, config.known_delay_s);
  }

  [[nodiscard]] detail::Coordinates coordinates_of(const DriveModel& start) const {
    const double omega = kTwoPi * lines.frequency_hz.front();
    return {start.parameters.driven_inertia * omega, config.sample_time_s,
            start.parameters.driven_inertia * omega * omega};
  }

  /// Costs compare under one weighting only; a model error of its own makes every fit's cost alike.
  bool worse(const ResponseFit& a, const ResponseFit& b) const {
    return config.weighting == Weighting::model_error ? b.likelihood < a.likelihood : b.cost < a.cost;
  }

  /// (J'J)^-1 J'C J (J'J)^-1: the weighting takes lines for independent; C is how they are correlated.
  ParameterCovariance correlated_covariance(const detail::LeastSquaresResult& solution) const {
    ParameterCovariance covariance = detail::covariance(solution, kParameterCount);
    if (lines.correlation.value.empty()) return covariance;
    Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(solution.jacobian.rows(), kParameterCount);
    for (std::size_t k = 0; k < solution.active.size(); ++k)
      jacobian.col(solution.active[k]) = solution.jacobian.col(static_cast<Eigen::Index>(k));
    Eigen::MatrixXd correlated = jacobian;
    const double reach = lines.correlation.distance_hz.back();
    for (std::size_t i = 0; i < lines.lines(); ++i)
      for (std::size_t k = i + 1; k < lines.lines() && lines.frequency_hz[k] - lines.frequency_hz[i] < reach;
           ++k) {
        const double rho = lines.correlation.at(lines.frequency_hz[k] - lines.frequency_hz[i]);
        const auto a = static_cast<Eigen::Index>(2 * i);
        const auto b = static_cast<Eigen::Index>(2 * k);
        correlated.middleRows(a, 2) += rho * jacobian.middleRows(b, 2);
        correlated.middleRows(b, 2) += rho * jacobian.middleRows(a, 2);
      }
    return covariance * (jacobian.transpose() * correlated) * covariance;
  }

  void assess(ResponseFit& fit) const {
    const auto fitted = as_measured(lines, fit.model);
    double misfit = 0.0;
    double likelihood = 0.0;
    const bool known = lines.std.size() == lines.lines();
    for (std::size_t i = 0; i < lines.lines(); ++i) {
      const double error = std::norm(lines.value[i] - fitted[i]);
      if (!known) continue;
      const double sd = lines.std[i];
      const double total = std::max(sd * sd + std::norm(fit.model_error * lines.value[i]), 1e-300);
      misfit += error / std::max(sd * sd, 1e-300);
      likelihood += 2.0 * (std::log(total) + error / total);
    }
    const double n = static_cast<double>(lines.lines());
    fit.misfit = std::sqrt(misfit / n);
    const double repeated = known_repetition(lines);
    fit.likelihood = likelihood;
    fit.bic = fit.bic_for(repeated);
  }
};

/// Every n-th line, in all about `count`.
data::FrequencyResponse some_of(const data::FrequencyResponse& lines, std::size_t count) {
  data::FrequencyResponse few;
  few.correlation = lines.correlation;
  few.smoothing.width_hz = lines.smoothing.width_hz;
  for (std::size_t i = 0; i < lines.lines(); i += lines.lines() / count) {
    few.frequency_hz.push_back(lines.frequency_hz[i]);
    few.value.push_back(lines.value[i]);
    few.std.push_back(lines.std[i]);
    if (!lines.smoothing.slope.empty()) few.smoothing.slope.push_back(lines.smoothing.slope[i]);
  }
  return few;
}

/// A search takes many steps far from its end, for which few lines do; the last ones are made with all.
ResponseFit search(const Fitter& fitter, const DriveModel& start) {
  constexpr std::size_t kFew = 300;
  if (fitter.config.weighting != Weighting::model_error || fitter.lines.lines() < 2 * kFew)
    return fitter.settle(start);
  const auto few = some_of(fitter.lines, kFew);
  const auto near = Fitter{few, fitter.config}.settle(start);
  const double error = near.model_error;
  auto fit = fitter.reweight(fitter.run(near.model, fitter.config.weighting, error, Fitter::kNear));
  // What stands between the few lines may be a mode.
  constexpr double kAlike = 1.3, kSmall = 0.01;
  if (fit.converged && fit.model_error < kAlike * error + kSmall) return fit;
  auto with_all = fitter.settle(start);
  return with_all.converged && (!fit.converged || fitter.worse(fit, with_all)) ? with_all : fit;
}

/// Delay at which the model's phase follows the response best: the largest Re sum conj(G) Gm e^{-jwd}, each
/// line weighted by how well it is known. The cost's own valley is only about 1/band wide, too narrow to be
/// found from 0.
double scanned_delay_s(const data::FrequencyResponse& g, const DriveModel& model) {
  const auto fitted = model.values(g.frequency_hz);
  const bool known = g.std.size() == g.lines();
  constexpr double kSoft = 0.3;    // as the first round of the fit
  constexpr double kStep = 0.125;  // samples
  std::vector<Complex> turned, step;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double size = std::abs(g.value[i]);
    const double relative = known && size > 0.0 ? g.std[i] / size : 0.0;
    const double turn = kTwoPi * g.frequency_hz[i] * model.sample_time_s;  // per sample of delay
    const double angle = std::arg(fitted[i]) - std::arg(g.value[i]) - turn * detail::kMinimumDelaySamples;
    turned.push_back(std::polar(1.0 / (kSoft * kSoft + relative * relative), angle));
    step.push_back(std::polar(1.0, -turn * kStep));
  }
  double best = -std::numeric_limits<double>::infinity();
  double best_s = 0.0;
  for (double samples = detail::kMinimumDelaySamples; samples <= detail::kMaximumDelaySamples;
       samples += kStep) {
    double sum = 0.0;
    for (std::size_t i = 0; i < turned.size(); ++i) {
      const Complex now = turned[i];
      sum += now.real();
      turned[i] = {now.real() * step[i].real() - now.imag() * step[i].imag(),
                   now.real() * step[i].imag() + now.imag() * step[i].real()};
    }
    if (sum <= best) continue;
    best = sum;
    best_s = samples * model.sample_time_s;
  }
  return best_s;
}

}  // namespace

double ResponseFit::bic_for(double lines_per_independent_line) const {
  const double independent = 2.0 * static_cast<double>(lines) / lines_per_independent_line;
  return likelihood / lines_per_independent_line +
         static_cast<double>(parameters) * std::log(std::max(independent, 2.0));
}

expected<ResponseFit, Error> fit_response(const data::FrequencyResponse& response,
                                          const ResponseFitConfig& config) {
  if (!(config.sample_time_s > 0.0)) return refuse("sample_time_s", "must be > 0", config.sample_time_s);
  if (!(config.known_delay_s >= 0.0)) return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
  auto lines = response.band(config.low_hz, config.high_hz);
  const auto wanted = static_cast<std::size_t>(order_of(config.structure) + 1);
  if (lines.lines() < wanted)
    return refuse("response", "needs at least 4 lines (rigid: 2, three masses: 6) in the band",
                  static_cast<double>(lines.lines()));
  if (config.weighting != Weighting::none && lines.std.size() != lines.lines())
    return refuse("response", "needs standard deviations for this weighting");
  std::vector<DriveModel> starts;
  if (config.initial) starts.push_back(*config.initial);
  for (const Parameter ground : {kMotorGroundStiffness, kLoadGroundStiffness}) {
    if (!starts.empty() ||
        std::find(config.further.begin(), config.further.end(), ground) == config.further.end())
      continue;
    if (auto start = detail::grounded_start(lines, config.structure, ground, config.sample_time_s))
      starts.push_back(std::move(*start));
  }
  if (starts.empty())
    starts = detail::initial_models(lines, config.structure, config.sample_time_s, config.viscous_friction);
  if (config.delay && !config.initial)
    for (auto& start : starts) start.delay_s = scanned_delay_s(lines, start);
  if (!config.initial)
    for (auto& start : starts) {
      start.velocity = config.velocity;
      start.torque_lag_s = config.torque_lag_s;
      start.output_filter_s = config.output_filter_s;
    }

  const Fitter fitter{lines, config};
  constexpr double kExplains = 1.2;  // misfit of a model that needs no other start
  std::optional<ResponseFit> best;
  for (const auto& start : starts) {
    auto fit = search(fitter, start);
    const bool better = !best || (fit.converged && (!best->converged || fitter.worse(*best, fit)));
    if (better) best = std::move(fit);
    if (best->converged && best->misfit > 0.0 && best->misfit < kExplains) break;
  }
  auto fit = std::move(*best);
  fit.lacking = fitter.lacking(fit);
  if (config.weighting != Weighting::model_error) return fit;
  // What lines repeat beyond what their method's smoothing explains: a model that is wrong in a smooth way.
  const double known = known_repetition(lines);
  fit.repetition = std::max(known, detail::repetition(lines, fit.model_error, as_measured(lines, fit.model)));
  fit.model.covariance *= fit.repetition / known;
  return fit;
}

}  // namespace resonid::fit
