// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/bootstrap/record_replicas.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/identify/select/select_black_box.hpp>
#include <identification/linear_simulation.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/plant/detail/white_noise.hpp>

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

/// The fit as it was, with the loop's controller in place of its estimate.
fit::OutputErrorConfig repeatable(const data::Record& record, const Plan& plan, const Options& options,
                                  const ModelResult& model) {
  auto config = config_of(model, {&record, 1}, options, plan.loop_controller);
  config.offset = model.offset.has_value();
  if (config.predictor != fit::Predictor::joint) return config;
  if (auto shown = fit::estimate_controller(record)) {
    config.predictor = fit::Predictor::closed_loop;
    config.controller = std::move(shown->controller);
  }
  return config;
}

}  // namespace

RecordReplicas::RecordReplicas(const data::Record& record, const Plan& plan, const Options& options,
                               const Result& result)
    : record_(record), residual_(result.residual), first_(result.residual_start), hold_(plan.hold) {
  noise_ = fit::fit_noise_model(residual_, fit::kHighestNoiseOrder);
  bool at_once = false;
  if (result.model) {
    const auto& drive = result.model->drive;
    drive_ = repeatable(record, plan, options, *result.model);
    // What a simulated loop leaves has been through the loop already.
    if (drive_->predictor != fit::Predictor::open_loop) return;
    plant_ = with_delay(drive.transfer_function(), (options.delay_s + drive.delay_s) * record.sample_rate_hz);
  } else {
    const auto& model = result.black_box->model;
    black_box_ = black_box_config(record, options, model);
    further_delay_ = result.black_box->further_delay.has_value();
    plant_ = delayed(model.transfer_function, model.delay_samples);
    at_once = plant_.numerator.front() != 0.0;
  }
  if (!options.controller || record.output_quantity != data::OutputQuantity::velocity || at_once) return;
  if (largest_pole(closed_loop(plant_, *options.controller)) < 1.0) controller_ = options.controller;
}

data::Record RecordReplicas::repeated(std::uint64_t seed) const {
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
  for (std::size_t k = 1; k < w.size(); ++k)
    if (!hold_.is_new(first_ + k)) w[k] = w[k - 1];  // as the record's own output stays
  for (std::size_t k = 0; k < w.size(); ++k) y[first_ + k] += w[k];
  return record;
}

std::optional<Result> RecordReplicas::fitted(std::uint64_t seed) const {
  const auto record = repeated(seed);
  Result replica;
  if (drive_) {
    auto fit = fit::fit_output_error(record, *drive_);
    if (!fit || !fit->converged) return std::nullopt;
    replica.model =
        ModelResult{fit->model, true, 0.0, fit->coulomb_friction, fit->offset, fit->further_friction};
    return replica;
  }
  auto fit = fit::fit_black_box(record, *black_box_);
  if (!fit || !fit->converged || !fit->stable) return std::nullopt;
  replica.black_box = BlackBoxResult{std::move(fit->model), fit->fit_percent, true, true, {}};
  if (further_delay_) {
    replica.black_box->further_delay = delay_of(replica.black_box->model);
    replica.black_box->further_delay->value -= black_box_->known_delay_s;
  }
  return replica;
}

}  // namespace resonid::identification::detail
