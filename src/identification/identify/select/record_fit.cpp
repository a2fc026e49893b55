// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <identification/identify/select/record_fit.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/diagnostics/residuals.hpp>

namespace resonid::identification::detail {
namespace {

/// 100 (1 - |y - yh| / |y - mean y|), every record about its own mean.
double pooled_fit_percent(const std::vector<fit::OutputErrorFit>& records) {
  if (records.size() == 1) return records.front().fit_percent;
  double left = 0.0, total = 0.0;
  for (const auto& r : records) {
    const double power = sum_of_squares(r.residual);
    const double ratio = 1.0 - 0.01 * r.fit_percent;
    if (!(ratio > 0.0)) continue;
    left += power;
    total += power / (ratio * ratio);
  }
  return total > 0.0 ? fit_percent_of(left, total) : 100.0;
}

double pooled_rms(const std::vector<fit::OutputErrorFit>& records) {
  double sum = 0.0, count = 0.0;
  for (const auto& r : records) {
    const double centre = mean(r.residual);
    for (const double e : r.residual) sum += (e - centre) * (e - centre);
    count += static_cast<double>(r.residual.size());
  }
  return std::sqrt(sum / std::max(1.0, count));
}

/// Criteria add up; the fits count by their samples.
std::optional<fit::HoldoutFit> pooled_holdout(const std::vector<fit::OutputErrorFit>& records) {
  if (records.size() == 1) return records.front().holdout;
  fit::HoldoutFit sum;
  double left = 0.0;
  for (const auto& r : records) {
    if (!r.holdout || r.holdout->samples == 0) continue;
    sum.samples += r.holdout->samples;
    sum.score += r.holdout->score;
    left += static_cast<double>(r.holdout->samples) * std::pow(1.0 - 0.01 * r.holdout->fit_percent, 2);
  }
  if (sum.samples == 0) return std::nullopt;
  sum.fit_percent = fit_percent_of(left, static_cast<double>(sum.samples));
  return sum;
}

}  // namespace

std::optional<RecordFit> fit_records(std::span<const data::Record> records, fit::OutputErrorConfig config) {
  config.consistency = false;
  auto fit = fit::fit_output_error(records, config);
  if (!fit) return std::nullopt;
  const double percent = pooled_fit_percent(fit->records), rms = pooled_rms(fit->records);
  auto holdout = pooled_holdout(fit->records);
  return RecordFit{std::move(fit->model),
                   fit->converged,
                   fit->coulomb_friction,
                   fit->further_friction,
                   std::move(fit->lacking_friction),
                   percent,
                   rms,
                   fit->bic,
                   holdout,
                   std::move(fit->records),
                   std::move(fit->against_others)};
}

void use_friction(const std::optional<data::Estimate>& coulomb, const fit::FurtherFriction& further,
                  fit::OutputErrorConfig& config) {
  config.coulomb_friction = coulomb.has_value();
  config.further_friction = further;
  if (coulomb && further.any()) config.coulomb_start = coulomb->value;
}

void use_predictor(std::span<const data::Record> records, const Options& options,
                   const std::optional<fit::ControllerEstimate>& loop_controller,
                   fit::OutputErrorConfig& config) {
  const bool velocity = records.front().output_quantity == data::OutputQuantity::velocity;
  if (options.approach == Approach::indirect && options.controller && velocity) {
    config.predictor = fit::Predictor::closed_loop;
    config.controller = options.controller;
  }
  const bool excited = std::all_of(records.begin(), records.end(),
                                   [](const data::Record& r) { return r.excitation.present(); });
  if (options.approach == Approach::joint && excited) config.predictor = fit::Predictor::joint;
  if (loop_controller) {
    config.predictor = fit::Predictor::closed_loop;
    config.controller = loop_controller->controller;
    if (loop_controller->model) config.controller_covariance = loop_controller->model->covariance;
  }
}

fit::OutputErrorConfig config_of(const ModelResult& model, std::span<const data::Record> records,
                                 const Options& options,
                                 const std::optional<fit::ControllerEstimate>& loop_controller) {
  fit::OutputErrorConfig config;
  config.initial = model.drive;
  config.viscous_friction = model.drive.estimated[fit::kViscousFriction];
  config.delay = model.drive.estimated[fit::kDelay];
  config.further = model.drive.further();
  use_friction(model.coulomb_friction, model.further_friction, config);
  config.known_delay_s = options.delay_s;
  use_predictor(records, options, loop_controller, config);
  return config;
}

expected<fit::OutputErrorFit, Error> simulation_by(const ModelResult& model, const data::Record& record,
                                                   double known_delay_s) {
  fit::OutputErrorConfig config;
  config.initial = model.drive;
  config.fixed_model = true;
  config.delay = model.drive.delay_s != 0.0;
  config.viscous_friction = model.drive.parameters.viscous_friction != 0.0;
  use_friction(model.coulomb_friction, model.further_friction, config);
  config.noise_model = false;
  config.known_delay_s = known_delay_s;
  return fit::fit_output_error(record, config);
}

data::Record simulated_record(data::Record record, const std::vector<double>& residual) {
  const auto explained = diagnostics::simulated_of(record.output.samples, residual);
  std::copy(explained.begin(), explained.end(),
            record.output.samples.end() - static_cast<std::ptrdiff_t>(explained.size()));
  return record;
}

}  // namespace resonid::identification::detail
