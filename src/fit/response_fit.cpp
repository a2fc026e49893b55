// SPDX-License-Identifier: MIT
#include <ceres/autodiff_cost_function.h>

#include <algorithm>
#include <fit/initial_models.hpp>
#include <fit/least_squares.hpp>
#include <fit/sampled_drive.hpp>
#include <resonid/fit/response_fit.hpp>

namespace resonid::fit {
namespace {

/// Weighted differences, real and imaginary part per line.
template <int Masses>
struct ResponseResiduals {
  const data::FrequencyResponse* response;
  std::vector<double> weight;
  detail::Coordinates coordinates;
  detail::SearchRange range;
  double known_delay_s = 0.0;

  template <class T>
  bool operator()(const T* x, T* residual) const {
    if (!range.contains(x, detail::Sizes<Masses>::kParameters)) return false;
    const double step = coordinates.sample_time_s;
    const detail::MeasuredResponse<Masses, T> measured(
        coordinates.parameters(x, Masses == 3), coordinates.delay_samples(x), known_delay_s / step, step);
    for (std::size_t i = 0; i < response->lines(); ++i) {
      const auto g = measured(response->frequency_hz[i]);
      residual[2 * i] = (g.re - T(response->value[i].real())) * T(weight[i]);
      residual[2 * i + 1] = (g.im - T(response->value[i].imag())) * T(weight[i]);
      if (!detail::finite(residual[2 * i]) || !detail::finite(residual[2 * i + 1])) return false;
    }
    return true;
  }
};

/// Smallest relative model error e with mean |error|^2 / (std^2 + (e |G|)^2) = (degrees of freedom)/(data).
double explaining_error(const data::FrequencyResponse& g, const std::vector<std::complex<double>>& fitted,
                        double wanted) {
  const auto mean = [&](double e) {
    double sum = 0.0;
    for (std::size_t i = 0; i < g.lines(); ++i) {
      const double bound = e * std::abs(g.value[i]);
      const double variance = g.standard_deviation[i] * g.standard_deviation[i] + bound * bound;
      sum += std::norm(g.value[i] - fitted[i]) / std::max(variance, 1e-300);
    }
    return sum / static_cast<double>(g.lines());
  };
  if (mean(0.0) <= wanted) return 0.0;
  double low = 0.0;
  double high = 1e-6;
  while (mean(high) > wanted && high < 1e3) high *= 4.0;
  for (int k = 0; k < 60; ++k) (mean(0.5 * (low + high)) > wanted ? low : high) = 0.5 * (low + high);
  return high;
}

std::vector<double> weights(const data::FrequencyResponse& g, Weighting weighting, double error) {
  std::vector<double> w(g.lines(), 1.0);
  if (weighting == Weighting::none) return w;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < g.lines(); ++i)
    if (g.standard_deviation[i] > 0.0) smallest = std::min(smallest, g.standard_deviation[i]);
  if (!std::isfinite(smallest)) smallest = 1e-12 * std::abs(g.value[0]) + 1e-300;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double bound = error * std::abs(g.value[i]);
    const double sd = std::hypot(std::max(g.standard_deviation[i], 1e-3 * smallest), bound);
    w[i] = std::sqrt(2.0) / sd;  // each of the two parts has half the variance
  }
  return w;
}

struct Fitter {
  const data::FrequencyResponse& lines;
  const ResponseFitConfig& config;

  ResponseFit run(const DriveModel& start, Weighting weighting, double error) const {
    ResponseFit fit;
    fit.model = start;
    fit.model.sample_time_s = config.sample_time_s;
    fit.model.known_delay_s = config.known_delay_s;
    fit.model.structure = config.structure;
    fit.model.estimated = estimated_parameters(config.structure, config.viscous_friction, config.delay);
    fit.model_error = error;
    if (!config.viscous_friction) fit.model.parameters.viscous_friction = 0.0;
    if (!config.delay) fit.model.delay_s = 0.0;

    detail::Coordinates coordinates{start.parameters.driven_inertia * kTwoPi * lines.frequency_hz.front(),
                                    config.sample_time_s};
    auto x = coordinates.from(fit.model);
    std::vector<detail::Bound> bounds;
    if (config.delay) bounds.push_back({kDelay, detail::kMinimumDelaySamples, detail::kMaximumDelaySamples});
    const auto solution = detail::with_masses(config.structure, [&](auto masses) {
      using Residuals = ResponseResiduals<masses>;
      constexpr int kParameters = detail::Sizes<masses>::kParameters;
      auto* functor = new Residuals{&lines, weights(lines, weighting, error), coordinates,
                                    detail::SearchRange(x), config.known_delay_s};
      auto cost = std::make_unique<ceres::AutoDiffCostFunction<Residuals, ceres::DYNAMIC, kParameters>>(
          functor, static_cast<int>(2 * lines.lines()));
      return detail::minimise(std::move(cost), std::span(x).template first<kParameters>(),
                              fit.model.estimated, bounds);
    });
    coordinates.store(x.data(), fit.model);
    fit.converged = solution.converged;
    fit.cost = solution.cost;

    ParameterCovariance covariance = detail::covariance(solution, kParameterCount);
    const double count = static_cast<double>(2 * lines.lines());
    const double free = count - static_cast<double>(solution.active.size());
    if (weighting == Weighting::none && free > 0.0) covariance *= 2.0 * fit.cost / free;
    const auto scale = coordinates.jacobian(fit.model);
    for (int i = 0; i < kParameterCount; ++i)
      for (int j = 0; j < kParameterCount; ++j)
        covariance(i, j) *= scale[static_cast<std::size_t>(i)] * scale[static_cast<std::size_t>(j)];
    fit.model.covariance = covariance;
    assess(fit, static_cast<double>(solution.active.size()));
    return fit;
  }

  void assess(ResponseFit& fit, double parameters) const {
    const auto fitted = fit.model.values(lines.frequency_hz, true);
    double misfit = 0.0;
    double likelihood = 0.0;
    const bool known = lines.standard_deviation.size() == lines.lines();
    for (std::size_t i = 0; i < lines.lines(); ++i) {
      const double error = std::norm(lines.value[i] - fitted[i]);
      if (!known) continue;
      const double sd = lines.standard_deviation[i];
      const double total = std::max(sd * sd + std::norm(fit.model_error * lines.value[i]), 1e-300);
      misfit += error / std::max(sd * sd, 1e-300);
      likelihood += 2.0 * (std::log(total) + error / total);
    }
    const double n = static_cast<double>(lines.lines());
    fit.misfit = std::sqrt(misfit / n);
    fit.information = likelihood + parameters * std::log(2.0 * n);
  }
};

/// Delay at which the model's phase follows the response best: the largest Re sum conj(G) Gm e^{-jwd}, each
/// line weighted by how well it is known. The cost's own valley is only about 1/band wide, too narrow to be
/// found from 0.
double scanned_delay_s(const data::FrequencyResponse& g, const DriveModel& model) {
  const auto fitted = model.values(g.frequency_hz);
  const bool known = g.standard_deviation.size() == g.lines();
  constexpr double kSoft = 0.3;  // as the first round of the fit
  double best = -std::numeric_limits<double>::infinity();
  double best_s = 0.0;
  for (double samples = detail::kMinimumDelaySamples; samples <= detail::kMaximumDelaySamples;
       samples += 0.125) {
    const double delay_s = samples * model.sample_time_s;
    double sum = 0.0;
    for (std::size_t i = 0; i < g.lines(); ++i) {
      const double size = std::abs(g.value[i]);
      const double relative = known && size > 0.0 ? g.standard_deviation[i] / size : 0.0;
      const double angle = std::arg(fitted[i]) - std::arg(g.value[i]) - kTwoPi * g.frequency_hz[i] * delay_s;
      sum += std::cos(angle) / (kSoft * kSoft + relative * relative);
    }
    if (sum <= best) continue;
    best = sum;
    best_s = delay_s;
  }
  return best_s;
}

/// By how much neighbouring lines repeat one another: 1 + 2 sum of the autocorrelation of the weighted
/// differences over the lines, up to where it has died out. Smoothed responses, and models that are wrong in
/// a smooth way, have many lines and little information.
double repetition(const data::FrequencyResponse& g, const ResponseFit& fit) {
  const auto fitted = fit.model.values(g.frequency_hz, true);
  std::vector<std::complex<double>> e;
  double power = 0.0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double sd = std::hypot(g.standard_deviation[i], fit.model_error * std::abs(g.value[i]));
    e.push_back((g.value[i] - fitted[i]) / std::max(sd, 1e-300));
    power += std::norm(e.back());
  }
  double sum = 1.0;
  for (std::size_t lag = 1; power > 0.0 && lag < e.size() / 4; ++lag) {
    double correlation = 0.0;
    for (std::size_t i = lag; i < e.size(); ++i) correlation += (e[i] * std::conj(e[i - lag])).real();
    correlation /= power;
    constexpr double kDiedOut = 0.15;
    if (correlation < kDiedOut) break;
    sum += 2.0 * correlation;
  }
  return sum;
}

}  // namespace

expected<ResponseFit, ConfigError> fit_response(const data::FrequencyResponse& response,
                                                const ResponseFitConfig& config) {
  if (!(config.sample_time_s > 0.0)) return refuse("sample_time_s", "must be > 0", config.sample_time_s);
  if (!(config.known_delay_s >= 0.0)) return refuse("known_delay_s", "must be >= 0", config.known_delay_s);
  auto lines = response.band(config.low_hz, config.high_hz);
  const auto wanted = static_cast<std::size_t>(order_of(config.structure) + 1);
  if (lines.lines() < wanted)
    return refuse("response", "needs at least 4 lines (rigid: 2, three masses: 6) in the band",
                  static_cast<double>(lines.lines()));
  if (config.weighting != Weighting::none && lines.standard_deviation.size() != lines.lines())
    return refuse("response", "needs standard deviations for this weighting");
  std::vector<DriveModel> starts;
  if (config.initial)
    starts.push_back(*config.initial);
  else
    starts = detail::initial_models(lines, config.structure, config.sample_time_s, config.viscous_friction);
  if (config.delay && !config.initial)
    for (auto& start : starts) start.delay_s = scanned_delay_s(lines, start);

  const Fitter fitter{lines, config};
  // From a soft weighting towards the data's own: a start far off must not follow its best-measured lines.
  const bool soft = config.weighting == Weighting::model_error;
  constexpr double kSoft = 0.3;
  std::optional<ResponseFit> best;
  for (const auto& start : starts) {
    auto fit = fitter.run(start, config.weighting, soft ? kSoft : 0.0);
    const bool better = !best || (fit.converged && (!best->converged || fit.cost < best->cost));
    if (better) best = std::move(fit);
  }
  auto fit = std::move(*best);
  if (!soft) return fit;
  for (int round = 0; round < 12; ++round) {
    const double parameters =
        static_cast<double>(std::count(fit.model.estimated.begin(), fit.model.estimated.end(), true));
    const double free = std::max(0.1, 1.0 - parameters / static_cast<double>(2 * lines.lines()));
    const double error = explaining_error(lines, fit.model.values(lines.frequency_hz, true), free);
    const double before = fit.model_error;
    fit = fitter.run(fit.model, Weighting::model_error, error);
    if (std::abs(error - before) <= 1e-3 * before + 1e-9) break;
  }
  fit.model.covariance *= repetition(lines, fit);
  return fit;
}

}  // namespace resonid::fit
