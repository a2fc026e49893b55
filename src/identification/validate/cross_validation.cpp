// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/identify/select/record_fit.hpp>
#include <identification/linear_simulation.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/output_error.hpp>
#include <resonid/identification/detail/cross_validation.hpp>
#include <resonid/identification/validate.hpp>

namespace resonid::identification {
namespace {

using diagnostics::Severity;

std::optional<double> fit_percent(const data::Record& record, const ModelResult& model,
                                  const Options& options) {
  fit::OutputErrorConfig config;
  config.initial = model.drive;
  config.fixed_model = true;
  config.noise_model = false;
  config.known_delay_s = options.delay_s;
  config.viscous_friction = model.drive.estimated[fit::kViscousFriction];
  detail::use_friction(model.coulomb_friction, model.further_friction, config);
  const auto simulation = fit::fit_output_error(record, config);
  if (!simulation) return std::nullopt;
  return simulation->fit_percent;
}

std::optional<double> fit_percent(const data::Record& record, const fit::BlackBoxModel& model) {
  if (!detail::can_be_simulated(model.transfer_function, record.samples())) return std::nullopt;
  const auto& y = record.output.samples;
  const auto simulation = detail::simulate_nearest(
      detail::delayed(model.transfer_function, model.delay_samples), record.input.samples, y, false);
  const double total = squares_about_mean(y);
  double left = 0.0;
  for (std::size_t k = 0; k < y.size(); ++k) left += std::pow(y[k] - simulation.output[k], 2);
  if (!(total > 0.0) || !std::isfinite(left)) return std::nullopt;
  return fit_percent_of(left, total);
}

void compare_structures(const data::Record& record, const Options& options, Result& result) {
  for (auto& trial : result.structures) {
    if (trial.model)
      trial.independent_fit_percent = fit_percent(record, *trial.model, options);
    else if (trial.black_box)
      trial.independent_fit_percent = fit_percent(record, *trial.black_box);
    else if (trial.chosen && result.independent)
      trial.independent_fit_percent = result.independent->simulation_fit_percent;
  }
}

void judge(Verdict verdict, Result& result) {
  const auto& v = *result.independent;
  if (verdict == Verdict::accepted) return;
  const bool rejected = verdict == Verdict::rejected;
  result.findings.push_back(
      {"fails-elsewhere",
       rejected ? Severity::error : Severity::warning,
       v.simulation_fit_percent,
       {},
       fmt::format(
           "On {}, to which it was not fitted, the model is {}: the fit of its simulation is {:.1f} % "
           "(NRMSE) there. Compare both recordings: the machine or its operating point differs.",
           v.file, rejected ? "rejected" : "doubtful", v.simulation_fit_percent)});
  if (rejected) result.trusted = false;
}

}  // namespace

expected<void, Error> validate_on(const data::Record& record, const Options& options, Result& result) {
  if (!result.model && !result.black_box)
    return tl::unexpected(Error{"independent", "the result has no model to be validated"});
  const CandidateModel candidate = candidate_of(result);
  ValidateOptions how;
  how.common = options;
  how.common.progress = {};
  const auto v = validate(record, candidate, how);
  if (!v) return tl::unexpected(v.error());
  result.independent = IndependentValidation{v->record.file,
                                             v->approach,
                                             v->simulation_fit_percent,
                                             v->prediction_fit_percent,
                                             v->response_error,
                                             std::string(name_of(v->verdict))};
  compare_structures(record, options, result);
  judge(v->verdict, result);
  return {};
}

}  // namespace resonid::identification
