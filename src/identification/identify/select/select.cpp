// SPDX-License-Identifier: MIT
#include <identification/criteria.hpp>
#include <identification/identify/measure/distortion.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <identification/identify/select/motion_model.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <identification/identify/select/select.hpp>
#include <identification/identify/select/simulate_and_correct.hpp>
#include <identification/progress.hpp>

namespace resonid::identification::detail {
namespace {

expected<void, Error> fit_black_box(const Experiment& experiment, const Options& options, Fitted& fitted) {
  auto chosen = select_black_box(experiment.record, options, {options.band_hz, true});
  if (!chosen) return tl::unexpected(std::move(chosen.error()));
  fitted.structures = std::move(chosen->structures);
  fitted.choices = std::move(chosen->choices);
  fitted.black_box = std::move(*chosen);
  return {};
}

/// A measured response has the dry friction of the record in it, and what its method makes of the motion:
/// what the drive alone says differs from it. The record simulated with friction, measured alike, has both
/// too.
std::optional<MeasuredAlike> measured_alike(const Experiment& experiment, const Measurement& m,
                                            const Options& options, const Selection& selection) {
  const auto& model = selection.result;
  if (!model.from_record || !model.has_dry_friction() || !(model.model_error > kCriteria.misfit)) return {};
  const auto error_of = [&](const std::vector<double>& residual) -> std::optional<double> {
    const auto shown = measure_response(simulated_record(experiment.record, residual), m.plan, options);
    if (!shown || shown->lines() != m.response.lines()) return {};
    return difference(shown->value, m.response).unexplained;
  };
  const auto error = error_of(selection.residual);
  if (!error) return {};
  if (*error > kCriteria.misfit) return MeasuredAlike{*error, false};
  ModelResult smooth = model;
  smooth.coulomb_friction.reset();
  smooth.further_friction = {};
  const auto simulated = simulation_by(smooth, experiment.record, options.delay_s);
  const auto without = simulated ? error_of(simulated->residual) : std::nullopt;
  return MeasuredAlike{*error, without && *without > kCriteria.misfit};
}

/// Distortion repeats with every period, and a likelihood would take each for new information.
void fit_drive(const Experiment& experiment, const Measurement& m, const Options& options, Fitted& fitted) {
  if (experiment.motion) fitted.drive = model_in_motion(experiment, options, m.response);
  const bool in_motion = fitted.drive.has_value();
  if (!in_motion)
    fitted.drive = select_model({&experiment.record, 1}, m.plan, options,
                                without_bias(m.response, m.evidence), {}, !exceeds_noise(m.distortion));
  if (!fitted.drive) return;
  if (!in_motion && fitted.drive->result.from_record)
    fitted.drive->contradiction = inspect_against_motion(experiment.record, options, fitted.drive->result);
  if (!in_motion) fitted.drive->measured_alike = measured_alike(experiment, m, options, *fitted.drive);
  fitted.structures = std::move(fitted.drive->structures);
  fitted.choices = {fitted.drive->choice};
}

}  // namespace

expected<Fitted, Error> select(const Experiment& experiment, const Measurement& measurement,
                               const Options& options) {
  Fitted fitted;
  if (options.model == ModelChoice::black_box) {
    if (auto done = fit_black_box(experiment, options, fitted); !done)
      return tl::unexpected(std::move(done.error()));
  } else if (options.model != ModelChoice::none) {
    fit_drive(experiment, measurement, options, fitted);
  }
  if (options.method == Method::simulate_and_correct) {
    tell(options, "correcting the response");
    fitted.corrected = measurement.response;
    auto done =
        simulate_and_correct(experiment.record, measurement.plan, options, *fitted.corrected, fitted.drive);
    if (!done) return tl::unexpected(std::move(done.error()));
  }
  if (options.method == Method::model && !fitted.present())
    return tl::unexpected(Error{"method", "model needs .model other than none, and a fit"});
  return fitted;
}

}  // namespace resonid::identification::detail
