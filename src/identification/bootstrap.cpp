// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/bootstrap.hpp>
#include <identification/linear_simulation.hpp>
#include <identification/parallel.hpp>
#include <identification/uncertainty.hpp>
#include <mutex>
#include <numbers>
#include <resonid/excitation/splitmix64.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/fit/response_fit.hpp>
#include <resonid/identification/figures.hpp>
#include <resonid/plant/white_noise.hpp>

namespace resonid::identification::detail {
namespace {

/// Gaussian noise of an autoregressive model, past its own beginning.
std::vector<double> coloured_noise(const fit::NoiseModel& noise, std::size_t samples, std::uint64_t seed) {
  constexpr std::size_t kSettling = 2000;
  plant::WhiteNoise white(seed, std::sqrt(noise.innovation_variance));
  std::vector<double> all(noise.order() == 0 ? samples : samples + kSettling);
  for (std::size_t k = 0; k < all.size(); ++k) {
    double e = white.step();
    for (std::size_t i = 1; i <= std::min(k, noise.order()); ++i) e -= noise.polynomial[i] * all[k - i];
    all[k] = e;
  }
  return {all.end() - static_cast<std::ptrdiff_t>(samples), all.end()};
}

std::uint64_t seed_of(std::uint64_t seed, std::size_t replica) {
  excitation::SplitMix64 mix(seed);
  const std::uint64_t own = mix.next();
  excitation::SplitMix64 far(own + 0x9e3779b97f4a7c15ULL * (replica + 1));
  return far.next();
}

/// One step of b/a in its direct form, from the signals' past and the newest input.
double filtered(const std::vector<double>& b, const std::vector<double>& a, const std::vector<double>& input,
                const std::vector<double>& output, std::size_t k) {
  double sum = 0.0;
  for (std::size_t i = 0; i < b.size() && i <= k; ++i) sum += b[i] * input[k - i];
  for (std::size_t i = 1; i < a.size() && i <= k; ++i) sum -= a[i] * output[k - i];
  return sum / a[0];
}

/// The plant with its delay; a fraction of a sample is shared between the two samples around it.
data::TransferFunction with_delay(data::TransferFunction g, double delay_samples) {
  const double whole = std::floor(std::max(0.0, delay_samples));
  const double fraction = std::max(0.0, delay_samples) - whole;
  const auto shift = static_cast<std::size_t>(whole);
  std::vector<double> b(g.numerator.size() + shift + 1, 0.0);
  for (std::size_t i = 0; i < g.numerator.size(); ++i) {
    b[i + shift] += (1.0 - fraction) * g.numerator[i];
    b[i + shift + 1] += fraction * g.numerator[i];
  }
  g.numerator = std::move(b);
  return g;
}

/// What differs from the record when other noise w runs through the loop: dy = G du + w, du = -C dy.
struct LoopDifference {
  std::vector<double> input, output;
};
LoopDifference in_the_loop(const data::TransferFunction& g, const data::TransferFunction& controller,
                           const std::vector<double>& w) {
  LoopDifference d{std::vector<double>(w.size()), std::vector<double>(w.size())};
  std::vector<double> through(w.size()), feedback(w.size());
  for (std::size_t k = 0; k < w.size(); ++k) {
    through[k] = filtered(g.numerator, g.denominator, d.input, through, k);  // du[k] is 0 yet, and b0 is 0
    d.output[k] = through[k] + w[k];
    feedback[k] = filtered(controller.numerator, controller.denominator, d.output, feedback, k);
    d.input[k] = -feedback[k];
  }
  return d;
}

/// Repeats the experiment of a model that was fitted to the record.
class RecordReplicas {
 public:
  RecordReplicas(const data::Record& record, const Options& options, const Result& result)
      : record_(record), residual_(result.residual), first_(result.residual_start) {
    const auto& drive = result.model->drive;
    constexpr std::size_t kOrder = 32;
    noise_ = fit::fit_noise_model(residual_, kOrder);
    config_.initial = drive;
    config_.viscous_friction = drive.estimated[fit::kViscousFriction];
    config_.delay = drive.estimated[fit::kDelay];
    config_.coulomb_friction = result.model->coulomb_friction.has_value();
    config_.offset = result.model->offset.has_value();
    config_.known_delay_s = options.delay_s;
    if (options.controller && record.output_quantity == data::OutputQuantity::velocity) {
      plant_ =
          with_delay(drive.transfer_function(), (options.delay_s + drive.delay_s) * record.sample_rate_hz);
      controller_ = options.controller;
      if (!(largest_pole(closed_loop(plant_, *controller_)) < 1.0)) controller_.reset();
    }
  }

  [[nodiscard]] std::optional<ModelResult> fitted(std::uint64_t seed) const {
    auto record = record_;
    auto w = coloured_noise(noise_, residual_.size(), seed);
    for (std::size_t k = 0; k < w.size(); ++k) w[k] -= residual_[k];
    auto& y = record.output.samples;
    auto& u = record.input.samples;
    if (controller_) {
      const auto d = in_the_loop(plant_, *controller_, w);
      for (std::size_t k = 0; k < w.size(); ++k) u[first_ + k] += d.input[k];
      w = d.output;
    }
    for (std::size_t k = 0; k < w.size(); ++k) y[first_ + k] += w[k];
    auto fit = fit::fit_output_error(record, config_);
    if (!fit || !fit->converged) return std::nullopt;
    return ModelResult{fit->model, true, 0.0, fit->coulomb_friction, fit->offset};
  }

 private:
  const data::Record& record_;
  const std::vector<double>& residual_;
  std::size_t first_;
  fit::NoiseModel noise_;
  fit::OutputErrorConfig config_;
  data::TransferFunction plant_;
  std::optional<data::TransferFunction> controller_;
};

/// Repeats the measured lines of a model that was fitted to the response.
class LineReplicas {
 public:
  LineReplicas(const data::Record& record, const Options& options, const Result& result)
      : lines_(result.response) {
    const auto& drive = result.model->drive;
    lines_.value = drive.values(lines_.frequency_hz, true);
    const double error = result.model->model_error;
    for (std::size_t i = 0; i < lines_.lines(); ++i)
      spread_.push_back(std::hypot(lines_.standard_deviation[i], error * std::abs(lines_.value[i])));
    config_.structure = drive.structure;
    config_.sample_time_s = record.sample_time_s();
    config_.known_delay_s = options.delay_s;
    config_.viscous_friction = drive.estimated[fit::kViscousFriction];
    config_.delay = drive.estimated[fit::kDelay];
    config_.initial = drive;
  }

  [[nodiscard]] std::optional<ModelResult> fitted(std::uint64_t seed) const {
    auto lines = lines_;
    plant::WhiteNoise white(seed, 1.0 / std::numbers::sqrt2);  // of real and imaginary part
    for (std::size_t i = 0; i < lines.lines(); ++i) {
      const double real = white.step();
      lines.value[i] += spread_[i] * std::complex<double>(real, white.step());
    }
    auto fit = fit::fit_response(lines, config_);
    if (!fit || !fit->converged) return std::nullopt;
    return ModelResult{fit->model, false, 0.0, std::nullopt, std::nullopt};
  }

 private:
  data::FrequencyResponse lines_;
  std::vector<double> spread_;
  fit::ResponseFitConfig config_;
};

/// All figures of one repetition; none when its fit did not come out.
std::vector<Figure> figures_of(const std::optional<ModelResult>& model, const Units& units,
                               const LoopOfModel& loop_of_model) {
  if (!model) return {};
  Result replica;
  replica.units = units;
  replica.model = model;
  replica.resonances = resonances_of(replica.model->drive);
  auto plain = *model;
  plain.drive.covariance.setZero();
  plain.drive.estimated.fill(false);  // its margins need no error bars of their own
  replica.loop = loop_of_model(plain);
  return figures(replica);
}

/// Interpolated between the ordered values.
double quantile(const std::vector<double>& ordered, double probability) {
  const double at = probability * static_cast<double>(ordered.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, ordered.size() - 1);
  return ordered[below] + (at - static_cast<double>(below)) * (ordered[above] - ordered[below]);
}

double deviation(const std::vector<double>& values) {
  double mean = 0.0, sum = 0.0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  for (const double v : values) sum += (v - mean) * (v - mean);
  return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

Bootstrap summary(const std::vector<Figure>& told, const std::vector<std::vector<Figure>>& replicas,
                  double confidence) {
  Bootstrap bootstrap;
  for (const auto& r : replicas) ++(r.empty() ? bootstrap.failed : bootstrap.replicas);
  for (const auto& figure : told) {
    std::vector<double> values;
    for (const auto& r : replicas)
      if (const auto* same = find(r, figure.name)) values.push_back(same->value);
    // A figure that most replicas lack (a crossover that noise takes away) has no interval.
    if (values.size() < 2 || 2 * values.size() < bootstrap.replicas) continue;
    std::sort(values.begin(), values.end());
    const double tail = 0.5 * (1.0 - confidence);
    bootstrap.intervals.push_back(
        {figure.name, figure.unit, quantile(values, tail), quantile(values, 1.0 - tail), deviation(values)});
  }
  return bootstrap;
}

}  // namespace

Bootstrap bootstrap(const data::Record& record, const Options& options, const Result& result,
                    const LoopOfModel& loop_of_model) {
  std::optional<RecordReplicas> of_record;
  std::optional<LineReplicas> of_lines;
  if (result.model->from_record && !result.residual.empty())
    of_record.emplace(record, options, result);
  else
    of_lines.emplace(record, options, result);
  std::vector<std::vector<Figure>> replicas(options.bootstrap);
  std::mutex telling;
  std::size_t done = 0;
  for_each_index(options.bootstrap, options.jobs, [&](std::size_t i) {
    const auto seed = seed_of(options.seed, i);
    const auto model = of_record ? of_record->fitted(seed) : of_lines->fitted(seed);
    replicas[i] = figures_of(model, result.units, loop_of_model);
    const std::lock_guard lock(telling);
    ++done;
    constexpr std::size_t kSteps = 10;  // tenths are told
    if (options.progress && done * kSteps / options.bootstrap != (done - 1) * kSteps / options.bootstrap)
      options.progress(fmt::format("bootstrap, {} of {} done", done, options.bootstrap));
  });
  return summary(figures(result), replicas, options.confidence);
}

}  // namespace resonid::identification::detail
