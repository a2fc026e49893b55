// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/bending.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/identify/prepare/units.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/parameter_words.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/output_error.hpp>
#include <string>
#include <string_view>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;
using fit::BendingTorque;

std::optional<fit::OutputErrorFit> tested(const ModelResult& model, const Experiment& experiment,
                                          const Measurement& measurement, const Options& options,
                                          std::size_t noise_order = fit::kHighestNoiseOrder) {
  auto config = config_of(model, {&experiment.record, 1}, options, measurement.plan.loop_controller);
  config.fixed_model = true;
  config.disturbances = true;
  config.max_noise_order = noise_order;
  auto fit = fit::fit_output_error(experiment.record, config);
  constexpr double kRounding = 1e-4;  // per cent of the output that a fit leaves
  if (!fit || fit->fit_percent > 100.0 - kRounding) return std::nullopt;
  return std::move(*fit);
}

bool drifts(BendingTorque t) {
  return t == BendingTorque::stiffness_drift || t == BendingTorque::inertia_drift ||
         t == BendingTorque::load_inertia_drift;
}

bool of_coupling(BendingTorque t) { return t == BendingTorque::stiffening || t == BendingTorque::backlash; }

const char* id_of(BendingTorque t) {
  switch (t) {
    case BendingTorque::stiffening:
      return "stiffening-coupling";
    case BendingTorque::backlash:
      return "backlash";
    case BendingTorque::torque_gain:
      return "torque-gain";
    case BendingTorque::stiffness_drift:
    case BendingTorque::inertia_drift:
    case BendingTorque::load_inertia_drift:
      return "changes-within-recording";
    default:
      return "dry-friction";
  }
}

bool of_friction(BendingTorque t) { return std::string_view(id_of(t)) == "dry-friction"; }

/// What drifts.
fit::Parameter parameter_of(const fit::Bending& b) {
  if (b.torque == BendingTorque::inertia_drift) return fit::kDrivenInertia;
  if (b.torque == BendingTorque::load_inertia_drift) return fit::kLoadInertia;
  return b.coupling == 0 ? fit::kStiffness : fit::kStiffness2;
}

/// Largest relative move of an inertia or a stiffness, and largest move of any parameter in its bars.
struct Effect {
  double relative = 0.0, deviations = 0.0;
};

Effect effect_of(const fit::Bending& b, const fit::DriveModel& model) {
  Effect e;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (!model.estimated[static_cast<std::size_t>(i)]) continue;
    const double moved = std::abs(b.shift(i)), bar = std::sqrt(std::max(0.0, model.covariance(i, i)));
    if (bar > 0.0) e.deviations = std::max(e.deviations, moved / bar);
    const double value = std::abs(model.value(static_cast<fit::Parameter>(i)));
    if (essential(i) && value > 0.0) e.relative = std::max(e.relative, moved / value);
  }
  if (drifts(b.torque)) {  // evenly spread over what it goes through
    const auto p = parameter_of(b);
    const double scatter = std::abs(b.amplitude) / std::sqrt(12.0);
    const double bar = std::sqrt(std::max(0.0, model.covariance(p, p)));
    e.relative = std::max(e.relative, scatter);
    if (bar > 0.0) e.deviations = std::max(e.deviations, scatter * model.value(p) / bar);
  }
  return e;
}

void widen(const fit::Bending& b, fit::DriveModel& model) {
  fit::ParameterVector shift = b.shift;
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (!model.estimated[static_cast<std::size_t>(i)]) shift(i) = 0.0;
  model.covariance += shift * shift.transpose();
  if (!drifts(b.torque)) return;
  const auto p = parameter_of(b);
  model.covariance(p, p) += std::pow(b.amplitude * model.value(p), 2) / 12.0;
}

std::string words_of(const fit::Bending& b, const Units& units) {
  const double a = b.amplitude;
  switch (b.torque) {
    case BendingTorque::stiffening:
      return fmt::format(
          "The coupling's torque does not follow its twist in proportion: it {} by {:.2g} % of "
          "the stiffness where the twist is as large as its standard deviation. What is found "
          "holds for this amplitude only. Excite as strongly as the machine is used, or "
          "preload the coupling.",
          a > 0.0 ? "hardens" : "softens", 100.0 * std::abs(a));
    case BendingTorque::backlash:
      if (a > 0.0)
        return fmt::format(
            "The coupling has play, about {:.2g} {} in all, or hardens with its twist. "
            "What is found holds for this amplitude only. Preload the coupling (a constant "
            "load, or motion in one direction) and record again.",
            a, position_unit(units.velocity));
      return "The coupling is stiffer about its middle than beyond, as one that slips or yields: what is "
             "found "
             "holds for this amplitude only. Excite less, and record again.";
    case BendingTorque::dry_friction:
    case BendingTorque::load_dry_friction:
      return fmt::format(
          "Dry friction{} of about {:.2g} {} acts beside the model. Move during the experiment, "
          "without turning back, or excite more strongly.",
          b.torque == BendingTorque::load_dry_friction ? " on the load" : "", std::abs(a), units.torque);
    case BendingTorque::stribeck_friction:
    case BendingTorque::load_stribeck_friction:
      return fmt::format(
          "Friction{} differs by about {:.2g} {} at low speed from what it is at a higher one. "
          "Move during the experiment, without turning back, or excite more strongly.",
          b.torque == BendingTorque::load_stribeck_friction ? " on the load" : "", std::abs(a), units.torque);
    case BendingTorque::stiffness_drift:
    case BendingTorque::inertia_drift:
    case BendingTorque::load_inertia_drift: {
      return fmt::format(
          "The {} changes by about {:.2g} % from the recording's start to its end. Follow it "
          "with track, or take a part (.from_s, .to_s) in which it stays. Under a single sweep, a mass or a "
          "lag that the model lacks looks the same.",
          parameter_words(parameter_of(b)), 100.0 * std::abs(a));
    }
    case BendingTorque::torque_gain:
      break;
  }
  return "The torque does not follow its command in proportion: its gain depends on its size. Check the "
         "torque "
         "loop's limits, or excite less.";
}

std::string effect_in_words(const Effect& e, bool error) {
  if (error) return fmt::format(" It moves inertia or stiffness by {:.2g} %.", 100.0 * e.relative);
  return " The error bars include its effect on the parameters.";
}

/// A torque that two masses would have in the third one's place. Held against white noise: a model of the
/// residual would take what the third mass explains for its colour.
std::optional<Finding> instead_of_third(const Selection& chosen, const Experiment& experiment,
                                        const Measurement& measurement, const Options& options) {
  constexpr std::size_t kWhite = 0;
  const auto& simpler = *chosen.simpler;
  const auto fit = tested(simpler, experiment, measurement, options, kWhite);
  if (!fit || fit->bending.empty()) return std::nullopt;
  const double two = mean_square(fit->residual), three = mean_square(chosen.residual);
  const double bent = fit->noise.innovation_variance;
  if (!(two - bent > kCriteria.as_well_as_a_mass * (two - three))) return std::nullopt;
  // Under a single sweep time, twist and frequency go together; a course over time is the likelier cause.
  auto cause = fit->bending.begin();
  for (auto b = cause; b != fit->bending.end() && !drifts(cause->torque); ++b)
    if (drifts(b->torque) && b->share > kCriteria.trace_share * fit->bending.front().share) cause = b;
  const auto& b = *cause;
  const auto e = effect_of(b, simpler.drive);
  return Finding{
      id_of(b.torque), Severity::error, e.relative, kCriteria.constant_parameter,
      words_of(b, experiment.units) +
          " With two masses, this fits the recording about as well as a third mass does, which need not "
          "exist."};
}

/// What a test found, told; the bars hold it.
std::vector<Finding> told(const std::vector<fit::Bending>& found, const Units& units, ModelResult& model) {
  std::vector<Finding> findings;
  const fit::DriveModel as_fitted = model.drive;
  for (const auto& b : found) {
    const auto e = effect_of(b, as_fitted);
    const bool strict = drifts(b.torque) || of_coupling(b.torque);
    const double most = strict ? kCriteria.constant_parameter : kCriteria.correctable_shift;
    const bool error = e.relative > most;
    // Bars may hold a drift already, but not either end of it.
    if (!(e.deviations > kCriteria.noticeable_shift) && !(error && drifts(b.torque))) continue;
    widen(b, model.drive);
    const std::string id = id_of(b.torque);
    // To first order only, the strongest leaves traces in all that resembles it.
    const bool trace = !findings.empty() && b.share < kCriteria.trace_share * found.front().share;
    const auto earlier =
        std::find_if(findings.begin(), findings.end(), [&](const Finding& f) { return f.id == id; });
    const bool again = earlier != findings.end();
    if ((trace && !again) || (again && (!error || earlier->severity == Severity::error))) continue;
    Finding finding{id, error ? Severity::error : Severity::info, e.relative, most,
                    words_of(b, units) + effect_in_words(e, error)};
    if (again)
      *earlier = std::move(finding);
    else
      findings.push_back(std::move(finding));
  }
  return findings;
}

}  // namespace

std::vector<Finding> inspect_bending(const Experiment& experiment, const Measurement& measurement,
                                     const Options& options, Selection& selection) {
  auto& model = selection.result;
  if (selection.in_motion) return {};
  auto fit = tested(model, experiment, measurement, options);
  if (!fit) return {};
  // Slow disturbances, for which a model is fitted to the response, look like drift and gain in the record,
  // and leave to the rest what chance has.
  if (!model.from_record) {
    const auto first = std::find_if(fit->bending.begin(), fit->bending.end(), [](const fit::Bending& b) {
      return !of_coupling(b.torque) && !of_friction(b.torque);
    });
    fit->bending.erase(first, fit->bending.end());
  }
  // A model that is none leaves more than any of these, and to them as chance has it.
  constexpr double kCause = 0.01;
  const bool clear = !fit->bending.empty() &&
                     (model.model_error <= kCriteria.worthless || fit->bending.front().share > kCause);
  std::vector<Finding> findings;
  if (clear) findings = told(fit->bending, experiment.units, model);
  if (!findings.empty() && model.from_record) selection.inconstant = inconstant(fit->constancy);
  if (selection.simpler)
    if (auto instead = instead_of_third(selection, experiment, measurement, options))
      findings.push_back(std::move(*instead));
  return findings;
}

}  // namespace resonid::identification::detail
