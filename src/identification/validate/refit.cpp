// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/parameter_words.hpp>
#include <identification/validate/refit.hpp>

namespace resonid::identification::detail {

std::optional<diagnostics::Finding> inspect_refit(const data::Record& record, const CandidateModel& candidate,
                                                  const Options& options) {
  using namespace fit;
  if (!candidate.model || !candidate.model->from_record || !record.input.present()) return std::nullopt;
  const auto& model = *candidate.model;
  if (model.has_dry_friction() && !record.excitation.present()) return std::nullopt;
  auto config = config_of(model, {&record, 1}, options, {});
  config.initial.sample_time_s = record.sample_time_s();
  auto fitted = fit_output_error(record, config);
  if (!fitted || !fitted->converged) return std::nullopt;
  widen(inconstant(fitted->constancy), fitted->model);
  double largest = 0.0;
  std::string text;
  for (const auto p : {kDrivenInertia, kLoadInertia, kStiffness, kMiddleInertia, kStiffness2}) {
    if (!has_parameter(model.drive.structure, p)) continue;
    const auto told = model.drive.estimate(p), found = fitted->model.estimate(p);
    const double difference = std::abs(found.value - told.value);
    const double deviation = std::hypot(found.std, std::isfinite(told.std) ? told.std : 0.0);
    if (!(deviation > 0.0) || !(difference > kCriteria.refitted_deviations * deviation)) continue;
    const double relative = difference / std::abs(told.value);
    if (!(relative > kCriteria.refitted_difference) || !(relative > largest)) continue;
    largest = relative;
    text = fmt::format(
        "Fitted to this recording, the {} is {:.4g}, {:.2g} % off the model's {:.4g} and {:.1f} standard "
        "deviations of both: the drive is another one here, or has changed (compare tells what).",
        parameter_words(p), found.value, 100.0 * relative, told.value, difference / deviation);
  }
  if (text.empty()) return std::nullopt;
  return diagnostics::Finding{"parameters-differ", diagnostics::Severity::warning, largest,
                              kCriteria.refitted_difference, std::move(text)};
}

}  // namespace resonid::identification::detail
