// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/linear_simulation.hpp>
#include <identification/validation_verdict.hpp>
#include <numeric>
#include <resonid/diagnostics/data_findings.hpp>
#include <resonid/fit/noise_model.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/identification/validate.hpp>

namespace resonid::identification {
namespace {

using diagnostics::Severity;

tl::unexpected<Refusal> refused(std::string option, std::string message) {
  return tl::unexpected(Refusal{std::move(option), std::move(message)});
}

double deviation(std::span<const double> x) {
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
  double sum = 0.0;
  for (const double v : x) sum += (v - mean) * (v - mean);
  return std::sqrt(sum);
}

double norm(std::span<const double> x) {
  return std::sqrt(std::inner_product(x.begin(), x.end(), x.begin(), 0.0));
}

class Simulator {
 public:
  Simulator(const data::Record& record, const CandidateModel& candidate, const ValidateOptions& options)
      : record_(record), options_(options) {
    v_.candidate = candidate;
    v_.known_delay_s = options.common.delay_s;
  }

  expected<ModelValidation, Refusal> run() {
    const bool indirect = options_.common.approach == Approach::indirect;
    v_.approach = indirect ? "indirect" : "direct";
    const auto done =
        indirect ? in_closed_loop() : (v_.candidate.model ? of_drive() : of_transfer_function());
    if (!done) return tl::unexpected(done.error());
    for (const double e : v_.residual)
      if (!std::isfinite(e)) return refused("model", "the simulated output is not finite");
    fit_percents();
    residual_tests();
    return std::move(v_);
  }

 private:
  [[nodiscard]] std::size_t delay_samples(double seconds) {
    const double samples = seconds * record_.sample_rate_hz;
    const double whole = std::round(samples);
    if (std::abs(samples - whole) > 0.1)
      v_.findings.push_back(
          {"delay-rounded", Severity::info, samples, whole,
           fmt::format("A delay of {:.2f} samples is simulated as {:.0f}.", samples, whole)});
    return static_cast<std::size_t>(std::max(0.0, whole));
  }

  expected<void, Refusal> of_drive() {
    fit::OutputErrorConfig config;
    config.initial = v_.candidate.model->drive;
    config.fixed_model = true;
    config.noise_model = false;
    config.known_delay_s = options_.common.delay_s;
    config.viscous_friction = config.initial.estimated[fit::kViscousFriction];
    config.coulomb_friction = v_.candidate.model->coulomb_friction.has_value();
    auto simulation = fit::fit_output_error(record_, config);
    if (!simulation)
      return refused(
          simulation.error().field == "known_delay_s" ? "delay" : std::string(simulation.error().field),
          std::string(simulation.error().requirement));
    v_.offset = simulation->offset;
    v_.coulomb_friction = simulation->coulomb_friction;
    v_.first_sample = simulation->first_sample;
    v_.residual = std::move(simulation->residual);
    for (std::size_t k = 0; k < v_.residual.size(); ++k)
      v_.simulated.push_back(record_.output.samples[v_.first_sample + k] - v_.residual[k]);
    return {};
  }

  /// From input to velocity, delay included.
  expected<data::TransferFunction, Refusal> plant() {
    if (record_.output_quantity != data::OutputQuantity::velocity)
      return refused("output-quantity",
                     fmt::format("found {}, required velocity: transfer functions and closed loops are "
                                 "simulated from input to velocity",
                                 record_.output_quantity == data::OutputQuantity::position ? "position"
                                                                                           : "acceleration"));
    if (v_.candidate.model) {
      auto drive = v_.candidate.model->drive;
      drive.sample_time_s = record_.sample_time_s();
      return detail::delayed(drive.transfer_function(),
                             delay_samples(options_.common.delay_s + drive.delay_s));
    }
    const auto& g = *v_.candidate.transfer_function;
    if (std::abs(g.sample_time_s - record_.sample_time_s()) > 0.01 * record_.sample_time_s())
      return refused("MODEL",
                     fmt::format("the transfer function runs at {:g} s, the record at {:g} s; required the "
                                 "record's sample time",
                                 g.sample_time_s, record_.sample_time_s()));
    return detail::delayed(g, delay_samples(options_.common.delay_s));
  }

  void keep(detail::LinearSimulation simulation) {
    v_.simulated = std::move(simulation.output);
    v_.offset = simulation.offset;
    for (std::size_t k = 0; k < v_.simulated.size(); ++k)
      v_.residual.push_back(record_.output.samples[k] - v_.simulated[k]);
  }

  expected<void, Refusal> of_transfer_function() {
    const auto g = plant();
    if (!g) return tl::unexpected(g.error());
    constexpr double kRounding = 1e-6;
    if (detail::largest_pole(*g) > 1.0 + kRounding)
      return refused("MODEL",
                     "the transfer function is unstable and cannot be simulated; required poles on or inside "
                     "the unit circle, or --approach indirect");
    keep(detail::simulate_nearest(*g, record_.input.samples, record_.output.samples, false));
    return {};
  }

  expected<void, Refusal> in_closed_loop() {
    const auto& controller = options_.common.controller;
    if (!controller) return refused("approach", "indirect needs --controller");
    if (!record_.excitation.present())
      return refused("approach", "indirect needs an excitation in the record");
    const auto g = plant();
    if (!g) return tl::unexpected(g.error());
    const auto loop = detail::closed_loop(*g, *controller);
    if (!(detail::largest_pole(loop) < 1.0))
      return refused("approach",
                     "indirect: the loop of this model with this controller is unstable, so it cannot be "
                     "simulated; required a stable one, or --approach direct");
    auto input = record_.excitation.samples;
    if (record_.reference.present()) {
      auto reference = record_.reference.samples;
      for (double& r : reference) r -= record_.reference.samples.front();
      const auto through = controller->simulate(reference);
      for (std::size_t k = 0; k < input.size(); ++k) input[k] += through[k];
    }
    keep(detail::simulate_nearest(loop, input, record_.output.samples, true));
    return {};
  }

  void fit_percents() {
    const auto output = std::span(record_.output.samples).subspan(v_.first_sample);
    const double total = deviation(output);
    if (!(total > 0.0)) return;
    v_.simulation_fit_percent = 100.0 * (1.0 - norm(v_.residual) / total);
    constexpr std::size_t kOrder = 32;
    const auto noise = fit::fit_noise_model(v_.residual, kOrder);
    const auto innovation = fit::whiten(v_.residual, noise);
    const auto foretold = output.subspan(output.size() - innovation.size());
    v_.prediction_fit_percent = 100.0 * (1.0 - norm(innovation) / deviation(foretold));
  }

  void residual_tests() {
    double delay = options_.common.delay_s;
    std::size_t poles = 3;
    if (v_.candidate.model) {
      delay += v_.candidate.model->drive.delay_s;
      poles = static_cast<std::size_t>(fit::order_of(v_.candidate.model->drive.structure));
    } else {
      const auto& g = *v_.candidate.transfer_function;
      poles = std::max(g.denominator.size(), g.numerator.size()) - 1;
    }
    const auto judged =
        poles + static_cast<std::size_t>(std::max(0.0, std::round(delay * record_.sample_rate_hz)));
    const auto part = [&](const data::Channel& c) {
      return c.present() ? std::span(c.samples).subspan(v_.first_sample) : std::span<const double>();
    };
    v_.residual_test =
        diagnostics::test_residual({v_.residual, v_.simulated, part(record_.input), part(record_.excitation)},
                                   std::max(options_.max_lag, judged), judged);
  }

  const data::Record& record_;
  const ValidateOptions& options_;
  ModelValidation v_;
};

/// Distance to the record's own response.
void compare_with_response(const Result& own, ModelValidation& v) {
  const auto& g = own.response;
  data::FrequencyResponse model;
  model.frequency_hz = g.frequency_hz;
  if (v.candidate.model) {
    auto drive = v.candidate.model->drive;
    drive.sample_time_s = 1.0 / own.record.sample_rate_hz;
    drive.known_delay_s = own.known_delay_s;
    model = drive.response(g.frequency_hz);
    model.value = drive.values(g.frequency_hz, true);
  } else {
    for (const double f : g.frequency_hz) model.value.push_back(v.candidate.transfer_function->response(f));
    model.standard_deviation.assign(g.lines(), 0.0);
  }
  double sum = 0.0;
  std::size_t lines = 0;
  for (std::size_t i = 0; i < g.lines(); ++i) {
    const double size = std::norm(g.value[i]);
    const double noise = g.standard_deviation.empty() ? 0.0 : std::pow(g.standard_deviation[i], 2);
    constexpr double kUsable = 0.25;  // std below half of |G|
    if (!(size > 0.0) || noise > kUsable * size || !std::isfinite(std::abs(model.value[i]))) continue;
    sum += (std::norm(g.value[i] - model.value[i]) - noise) / size;
    ++lines;
  }
  if (lines > 0) v.response_error = std::sqrt(std::max(0.0, sum / static_cast<double>(lines)));
  v.gap = diagnostics::gap_curve(g, model);
  if (!v.gap->noise.empty()) {
    const std::size_t worst = v.gap->most_excessive();
    const double f = v.gap->frequency_hz[worst];
    const double relative = std::abs(g.at(f) - model.at(f)) / std::max(std::abs(g.at(f)), 1e-300);
    v.worst_line_hz = f;
    v.worst_line_error = relative * std::sqrt(std::max(0.0, 1.0 - std::pow(v.gap->excess(worst), -2)));
    v.response_probability = v.gap->chance();
  }
  v.measured = g;
  v.modelled = std::move(model);
}

}  // namespace

expected<ModelValidation, Refusal> validate(const data::Record& record, const CandidateModel& candidate,
                                            const ValidateOptions& options) {
  if (!candidate.model && !candidate.transfer_function)
    return refused("MODEL", "holds no model; required a result with one, or a transfer function");
  auto validation = Simulator(record, candidate, options).run();
  if (!validation) return validation;
  Options own = options.common;
  own.model = ModelChoice::none;
  if (own.approach == Approach::indirect) own.approach.reset();
  if (const auto result = identify(record, own)) {
    validation->record = result->record;
    validation->units = result->units;
    compare_with_response(*result, *validation);
    validation->findings.insert(validation->findings.begin(), result->findings.begin(),
                                result->findings.end());
  } else {
    return tl::unexpected(result.error());
  }
  detail::judge(*validation);
  return validation;
}

}  // namespace resonid::identification
