// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/fit/detail/identified_controller.hpp>
#include <span>
#include <vector>

namespace resonid::fit {
namespace {

constexpr std::size_t kMostSamples = 100000, kFewest = 200;
constexpr int kHighestOrder = 4;
constexpr std::ptrdiff_t kLags = 20;

/// Input r - y and output u - ru of the controller, as a record.
data::Record controller_record(const data::Record& record) {
  const std::size_t n = std::min(kMostSamples, record.samples());
  const auto& y = record.output.samples;
  const double rest = mean(std::span(y).first(n));
  data::Record c;
  c.sample_rate_hz = record.sample_rate_hz;
  for (std::size_t k = 0; k < n; ++k) {
    c.input.samples.push_back((record.reference.present() ? record.reference.samples[k] : rest) - y[k]);
    c.output.samples.push_back(record.input.samples[k] - record.excitation.samples[k]);
  }
  return c;
}

/// Largest correlation of white noise with a signal `first_lag` ... kLags samples before it, beyond chance.
double correlation(std::span<const double> white, std::span<const double> signal, std::ptrdiff_t first_lag) {
  const auto n = static_cast<std::ptrdiff_t>(white.size());
  const double centre = mean(signal);
  const double scale = deviation(white) * deviation(signal) * static_cast<double>(n);
  if (!(scale > 0.0)) return 0.0;
  double largest = 0.0;
  for (std::ptrdiff_t lag = first_lag; lag <= kLags; ++lag) {
    double sum = 0.0;
    for (std::ptrdiff_t k = std::max<std::ptrdiff_t>(0, lag); k < n + std::min<std::ptrdiff_t>(0, lag); ++k)
      sum += white[static_cast<std::size_t>(k)] * (signal[static_cast<std::size_t>(k - lag)] - centre);
    largest = std::max(largest, std::abs(sum) / scale);
  }
  constexpr double kChance = 4.5;  // standard deviations
  return largest > kChance / std::sqrt(static_cast<double>(n)) ? largest : 0.0;
}

/// Whether what the controller leaves of u - ru is noise.
bool leaves_noise(const BlackBoxFit& fit, const data::Record& controller, const data::Record& record) {
  constexpr double kFollows = 0.05;
  const auto white = whiten(fit.residual, fit.noise);
  const auto with = [&](const std::vector<double>& signal, std::ptrdiff_t first_lag) {
    const std::size_t end = controller.samples();
    return correlation(white, std::span(signal).subspan(end - white.size(), white.size()), first_lag);
  };
  return with(controller.input.samples, 0) < kFollows && with(record.excitation.samples, -kLags) < kFollows;
}

std::optional<BlackBoxFit> best_fit(const data::Record& controller) {
  std::optional<BlackBoxFit> best;
  for (int order = 1; order <= kHighestOrder; ++order) {
    bool better = false;
    for (const bool integrator : {true, false}) {
      BlackBoxConfig config;
      config.order = order;
      config.direct_term = true;
      config.integrator = integrator;
      auto fit = fit_black_box(controller, config);
      if (!fit || !fit->converged || !fit->stable) continue;
      if (best && fit->bic >= best->bic) continue;
      best = std::move(*fit);
      better = true;
    }
    if (!better) break;
  }
  return best;
}

}  // namespace

std::optional<ControllerEstimate> estimate_controller(const data::Record& record) {
  if (auto exact = identified_controller(record))
    return ControllerEstimate{std::move(*exact), 0.0, 0.0, {}, {}};
  const std::size_t n = record.samples();
  if (n < kFewest || record.excitation.samples.size() != n || record.input.samples.size() != n ||
      (record.reference.present() && record.reference.samples.size() != n))
    return std::nullopt;
  const auto controller = controller_record(record);
  const double size = deviation(controller.output.samples);
  constexpr double kExplained = 20.0;  // per cent
  constexpr double kSilent = 1e-6;
  if (!(size > kSilent * deviation(record.input.samples))) return std::nullopt;
  auto fit = best_fit(controller);
  if (!fit || fit->fit_percent < kExplained || !leaves_noise(*fit, controller, record)) return std::nullopt;
  const double noise = deviation(fit->residual);
  return ControllerEstimate{fit->model.transfer_function, noise, noise / size, std::move(fit->residual),
                            std::move(fit->model)};
}

std::optional<ControllerEstimate> estimate_controller(std::span<const data::Record> records) {
  struct Own {
    ControllerEstimate estimate;
    double weight = 0.0;
  };
  std::vector<Own> all;
  for (const auto& record : records) {
    auto shown = estimate_controller(record);
    if (!shown && all.empty()) return std::nullopt;
    if (!shown) continue;
    if (!shown->model || !(shown->input_noise > 0.0)) return shown;
    const double weight = static_cast<double>(record.samples()) / (shown->input_noise * shown->input_noise);
    all.push_back({std::move(*shown), weight});
  }
  const auto order = [](const Own& own) { return own.estimate.controller.denominator.size(); };
  const auto like = [&](const Own& one) {
    return std::count_if(all.begin(), all.end(),
                         [&](const Own& other) { return order(one) == order(other); });
  };
  const auto typical =
      std::max_element(all.begin(), all.end(), [&](const Own& a, const Own& b) { return like(a) < like(b); });
  if (typical == all.end()) return std::nullopt;
  const std::size_t kind = order(*typical);
  std::erase_if(all, [&](const Own& own) { return order(own) != kind; });
  double total = 0.0;
  for (const auto& own : all) total += own.weight;
  data::TransferFunction c = all.front().estimate.controller;
  std::fill(c.numerator.begin(), c.numerator.end(), 0.0);
  std::fill(c.denominator.begin(), c.denominator.end(), 0.0);
  for (const auto& own : all) {
    const auto& b = own.estimate.controller.numerator;
    const auto& a = own.estimate.controller.denominator;
    for (std::size_t i = 0; i < std::min(b.size(), c.numerator.size()); ++i)
      c.numerator[i] += own.weight / total * b[i];
    for (std::size_t i = 0; i < a.size(); ++i) c.denominator[i] += own.weight / total * a[i];
  }
  ControllerEstimate& mean = all.front().estimate;
  mean.controller = std::move(c);
  mean.model->realisation.covariance *= all.front().weight / total;
  mean.model->covariance *= all.front().weight / total;
  return std::move(mean);
}

}  // namespace resonid::fit
