// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/identify/judge/trust.hpp>
#include <string_view>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

/// Of a motor that is fed a voltage, current not being controlled.
constexpr const char* kOfAMotorAtAVoltage =
    " Of a motor at a voltage they are ratios to its torque per volt: the viscous friction holds the "
    "back-EMF, "
    "a torque lag the electrical time constant. Resonances are as they are.";

bool is_voltage(std::string_view unit) { return unit == "V" || unit == "mV" || unit == "kV"; }

void inspect_resonance(const Plan& plan, const data::Mode& mode, bool one_of_several, Result& result) {
  auto& findings = result.findings;
  const double f = mode.frequency_hz.value;
  const auto name = one_of_several ? fmt::format("resonance at {:.3g} Hz", f) : std::string("resonance");
  const double relative = mode.frequency_hz.std / f;
  if (relative > kCriteria.uncertain_resonance)
    findings.push_back(
        {"uncertain-resonance", Severity::error, relative, kCriteria.uncertain_resonance,
         relative > 1.0
             ? fmt::format(
                   "The recording does not determine the {}: the measured response shows nothing there. "
                   "A model of fewer masses describes it as well (.model auto). To identify the "
                   "resonance, excite around {:.3g} Hz.",
                   name, f)
             : fmt::format("The {} is known to {:.0f} % only: excite more strongly around {:.3g} Hz or "
                           "record longer.",
                           name, 100.0 * relative, f)});
  const double zeta = mode.damping_ratio.value;
  if (!(zeta > 0.0) || zeta > 1.0)
    findings.push_back(
        {"unphysical-damping", Severity::error, zeta, 1.0,
         "The fitted damping ratio is not between 0 and 1, as that of a resonance is: the "
         "model is over-fitted. Excite the resonance more strongly, or take a model of fewer masses "
         "(.model)."});
  if (f < plan.low_hz || f > plan.high_hz)
    findings.push_back(
        {"resonance-outside-band", Severity::warning, f, f < plan.low_hz ? plan.low_hz : plan.high_hz,
         fmt::format("The fitted resonance {:.4g} Hz lies outside the excited band {:.4g} ... {:.4g} Hz: "
                     "it is an extrapolation. Excite up to it.",
                     f, plan.low_hz, plan.high_hz)});
}

void inspect_parameters(const Plan& plan, const Options& options, const fit::DriveModel& drive,
                        Result& result) {
  using namespace fit;
  auto& findings = result.findings;
  const auto modes = drive.modes();
  for (const auto& mode : modes)
    if (!mode.anti) inspect_resonance(plan, mode, modes.size() > 2, result);
  for (const auto p : {kDamping, kDamping2}) {
    const auto damping = drive.estimate(p);
    if (!has_parameter(drive.structure, p) || !(damping.std > kCriteria.uncertain_damping * damping.value))
      continue;
    findings.push_back(
        {"uncertain-damping", Severity::info, damping.std / damping.value, kCriteria.uncertain_damping,
         fmt::format("Only the order of magnitude of the damping{} is known: excite the resonance more "
                     "strongly, or record longer.",
                     p == kDamping2 ? " between middle and load" : "")});
  }
  const auto inertia = drive.estimate(kDrivenInertia);
  if (!(inertia.std < kCriteria.uncertain_inertia * inertia.value))
    findings.push_back(
        {"uncertain-inertia", Severity::error, inertia.std / inertia.value, kCriteria.uncertain_inertia,
         "The recording does not determine the inertia: excite more strongly or record longer."});
  // Lines find a third mass in any bend; one that is there they tell.
  if (drive.structure == Structure::three_mass && result.model && !result.model->from_record)
    for (const auto p : {kMiddleInertia, kLoadInertia}) {
      const auto further = drive.estimate(p);
      if (further.std < kCriteria.uncertain_inertia * further.value) continue;
      findings.push_back(
          {"uncertain-inertia", Severity::error, further.std / further.value, kCriteria.uncertain_inertia,
           fmt::format(
               "The measured response does not determine the inertia of the {}, which need not exist: "
               "excite more strongly or record longer.",
               p == kMiddleInertia ? "middle mass" : "load")});
      break;
    }
  if (!drive.estimated[kDelay]) return;
  findings.push_back(further_delay(drive.delay_s, options.delay_s));
}

Finding ground_side(const fit::DriveModel& chosen, const fit::DriveModel& other) {
  const auto change = [&](fit::Parameter p) { return 100.0 * (other.value(p) / chosen.value(p) - 1.0); };
  const bool at_load = chosen.parameters.load_ground_stiffness != 0.0;
  return {"ground-side",
          Severity::error,
          {},
          {},
          fmt::format(
              "The recording does not tell which side the spring to the ground holds: on the {} instead of "
              "the {} it is described as well, with a load inertia other by {:+.0f} % and a stiffness "
              "by {:+.0f} %. Resonances, margins and the motor inertia are the same. Say which it is "
              "(.ground motor, .ground load).",
              at_load ? "motor" : "load", at_load ? "load" : "motor", change(fit::kLoadInertia),
              change(fit::kStiffness))};
}

}  // namespace

void inspect_model(const Plan& plan, const Options& options, const std::optional<Selection>& selection,
                   Result& result) {
  auto& findings = result.findings;
  if (!result.units.physical)
    findings.push_back({"not-physical-units",
                        Severity::info,
                        {},
                        {},
                        fmt::format("The input is in {} and the output velocity in {}: the model's "
                                    "coefficients are in these units and are not inertias or stiffnesses. "
                                    "Give .input_scale and .output_scale to get physical parameters.{}",
                                    result.units.input, result.units.velocity,
                                    is_voltage(result.units.input) ? kOfAMotorAtAVoltage : "")});
  if (options.model == ModelChoice::none) return;
  if (!selection) {
    findings.push_back({"no-model",
                        Severity::error,
                        {},
                        {},
                        "No drive model could be fitted to this response: too few usable lines in the band. "
                        "Excite more strongly, or "
                        "widen .band_hz."});
    return;
  }
  const auto& model = selection->result;
  if (selection->contradiction) findings.push_back(*selection->contradiction);
  if (selection->other_ground) findings.push_back(ground_side(model.drive, *selection->other_ground));
  if (selection->outliers) findings.push_back(*selection->outliers);
  for (const bool over_frequency : {false, true})
    if (auto changes = inspect_constancy(selection->inconstant, model.drive, over_frequency))
      findings.push_back(std::move(*changes));
  if (result.model && !model.has_dry_friction() &&
      (options.friction == Friction::dry || options.friction == Friction::both))
    findings.push_back({"no-dry-friction",
                        Severity::warning,
                        {},
                        {},
                        "Dry friction was requested, but no fit with it succeeded: the model is without dry "
                        "friction. Move during "
                        "the experiment, so that friction shows."});
  const auto& alike = selection->measured_alike;
  const bool explained = alike && alike->error <= kCriteria.misfit;
  const bool tellable = model.model_error <= kCriteria.worthless || selection->in_motion || explained;
  if (model.model_error > kCriteria.misfit && explained && !alike->by_friction) {
    findings.push_back(
        {"response-biased", Severity::info, model.model_error, kCriteria.misfit,
         fmt::format(
             "The measured response typically differs by {:.0f} % from the model's, and so does that of "
             "the recording that the model simulates: motion and feedback bias it, not the machine. Use the "
             "model in its place.",
             100.0 * model.model_error)});
  } else if (model.model_error > kCriteria.misfit && tellable && model.has_dry_friction()) {
    findings.push_back(
        {"friction-in-response", Severity::info, model.model_error, kCriteria.misfit,
         fmt::format(
             "Dry friction distorts the measured response: it typically differs by {:.0f} % from the "
             "model, which describes the drive without its dry friction. Move during the experiment, without "
             "turning back, to measure it without friction.",
             100.0 * model.model_error)});
  } else if (model.model_error > kCriteria.misfit) {
    // Of the lines alone a model knows no more than they do, and what is smooth of a misfit is no noise.
    const bool bad = model.model_error > kCriteria.worthless || !model.from_record;
    findings.push_back(
        {"misfit", bad ? Severity::error : Severity::warning, model.model_error,
         bad && model.from_record ? kCriteria.worthless : kCriteria.misfit,
         fmt::format(
             "Model and measured response typically differ by {:.0f} % beyond the noise: {}a {} model "
             "does not fit. {}{}",
             100.0 * model.model_error,
             model.model_error > 1.0 ? "hardly anything excites the machine, a column is the wrong one, or "
                                     : "",
             model.drive.structure == fit::Structure::rigid ? std::string_view("rigid")
                                                            : fit::name_of(model.drive.structure),
             model.from_record
                 ? "The parameters' error bars include the noise of the recording, but not this difference."
                 : "The parameters' error bars include this difference as if it were noise, which it is not.",
             bad ? " A model without drive structure (.model black-box) may describe it."
                 : " Try another .model, or a narrower .band_hz.")});
  }
  if (!model.from_record)
    findings.push_back({"model-from-response",
                        Severity::info,
                        {},
                        {},
                        "The model was fitted to the measured response: slow disturbances or nonlinear "
                        "friction would dominate a fit to the recording itself. Its error bars rest on the "
                        "lines alone; record "
                        "without such disturbances for better ones."});
  if (model.from_record && options.approach == Approach::indirect &&
      result.record.output_quantity != data::OutputQuantity::velocity)
    findings.push_back({"indirect-response-only",
                        Severity::info,
                        {},
                        {},
                        "The measured response is indirect, the model is not: the closed-loop predictor "
                        "needs a recorded velocity, which the controller is fed. The model was fitted from "
                        "the recorded input, which is unbiased only if the noise model is right. Record the "
                        "velocity that the "
                        "controller is fed."});
  inspect_parameters(plan, options, model.drive, result);
}

void inspect_black_box(const BlackBoxResult& result, std::vector<Finding>& findings) {
  if (result.further_delay)
    findings.push_back(further_delay(result.further_delay->value, result.model.known_delay_s));
  if (!result.converged)
    findings.push_back({"not-converged",
                        Severity::error,
                        {},
                        {},
                        "The fit of the black-box model did not converge: its order is probably too high for "
                        "this recording. Try a lower .order."});
  double largest = 0.0;
  for (const auto& pole : result.model.poles()) largest = std::max(largest, std::abs(pole.value));
  if (!result.stable)
    findings.push_back(
        {"unstable-model", Severity::error, largest, 1.0,
         fmt::format("The black-box model is unstable: a pole lies at |z| = {:.6g}, outside "
                     "the unit circle by more than its error bar. The recording is not that of a "
                     "drive, or the order does not suit it. Try another .order.",
                     largest)});
}

Finding further_delay(double delay_s, double known_delay_s) {
  const double delay_ms = 1e3 * delay_s;
  Finding finding{"further-delay", Severity::info, delay_s, {}, {}};
  if (delay_s < 0.0 && known_delay_s > 0.0)
    finding.meaning =
        fmt::format("The recording shows {:.3g} ms less delay than the {:.3g} ms given: check that delay.",
                    -delay_ms, 1e3 * known_delay_s);
  else if (delay_s < 0.0)
    return {"input-ahead", Severity::info, delay_s, 0.0,
            fmt::format("The output comes {:.3g} ms earlier than with a zero-order hold at the input: the "
                        "input was measured, not commanded. This is taken into account.",
                        -delay_ms)};
  else if (known_delay_s > 0.0)
    finding.meaning =
        fmt::format("The recording shows {:.3g} ms more delay than the {:.3g} ms given: check that delay.",
                    delay_ms, 1e3 * known_delay_s);
  else
    finding.meaning = fmt::format(
        "The recording shows a delay of {:.3g} ms between input and output; it is part of the margins.",
        delay_ms);
  return finding;
}

void inspect_validation(Result& result) {
  if (result.model)
    for (const auto& mode : result.model->drive.modes()) {
      const double nyquist = 0.5 * result.record.sample_rate_hz, f = mode.frequency_hz.value;
      if (f < nyquist) continue;
      result.findings.push_back(
          {"mode-above-nyquist", Severity::error, f, nyquist,
           fmt::format("The model has a mode at {:.4g} Hz, above half the sample rate. The recording cannot "
                       "show such a mode: the model is over-fitted. Sample faster, or take a model of fewer "
                       "masses (.model).",
                       f)});
    }
  const auto& v = result.validation;
  if (!v || !v->of_record) return;
  if (v->fit_percent <= 0.0)
    result.findings.push_back(
        {"explains-nothing", Severity::error, v->fit_percent, 0.0,
         "No predictive power: the simulated output is no closer to the recorded output than "
         "the latter's mean is. Check columns, signs and units (.input, .output), or take "
         "another .model."});
  for (const auto& trial : result.structures)
    if (trial.chosen && v->fit_percent > 0.0 && trial.holdout_fit_percent.value_or(1.0) <= 0.0)
      result.findings.push_back(
          {"fails-on-held-back", Severity::error, trial.holdout_fit_percent, 0.0,
           "Fitted without the hold-out data, the model predicts them no better than "
           "their mean does: it is over-fitted. Record longer, or take a model with fewer "
           "parameters (.model, .order)."});
  const double left = v->cross_correlation_max.value_or(0.0);
  if (v->fit_percent < kCriteria.nearly_all && left > kCriteria.unexplained &&
      left > 3.0 * v->limit.value_or(0.0))
    result.findings.push_back(
        {"unexplained-response", Severity::error, left, kCriteria.unexplained,
         fmt::format("The residual is correlated with the input ({:.2f}): the model lacks dynamics "
                     "that the machine has, such as a further mass, a lag or friction. Try "
                     "another .model, or a narrower .band_hz.",
                     left)});
}

void inspect_loop(Result& result) {
  if (!result.loop) return;
  auto& findings = result.findings;
  const auto& margins = result.loop->margins;
  const auto worst = margins.worst_phase_margin_deg;
  if (worst && *worst <= 0.0)
    findings.push_back(
        {"unstable-loop", Severity::warning, *worst, 0.0,
         fmt::format(
             "The phase margin is {:.1f} deg: this loop would be unstable. Since the loop ran, the "
             "controller, delay or sign given does not belong to this recording. Correct it (.controller, "
             ".output_scale).",
             *worst)});
  else if (worst && *worst < kCriteria.phase_margin_deg)
    findings.push_back(
        {"small-phase-margin", Severity::warning, *worst, kCriteria.phase_margin_deg,
         fmt::format(
             "The smallest phase margin is {:.1f} deg, where 30 deg or more is usual: the loop is close to "
             "oscillating. Lower its gain or its delay.",
             *worst)});
  if (margins.modulus_margin < kCriteria.modulus_margin && !(worst && *worst <= 0.0))
    findings.push_back(
        {"small-modulus-margin", Severity::warning, margins.modulus_margin, kCriteria.modulus_margin,
         fmt::format(
             "The minimum distance to -1 (modulus margin) is {:.2f} at {:.3g} Hz: disturbances there are "
             "amplified {:.1f}-fold (Ms). Lower the gain, or damp the resonance (notch, filter).",
             margins.modulus_margin, margins.modulus_margin_hz,
             1.0 / std::max(margins.modulus_margin, 1e-6))});
  if (margins.crossovers.size() > 1)
    findings.push_back(
        {"several-crossovers", Severity::info, static_cast<double>(margins.crossovers.size()), 1.0,
         fmt::format("The loop gain |L| falls below 1 at {} frequencies. The phase margin "
                     "given is that at the first of them; judge the loop by the smallest, {:.1f} deg.",
                     margins.crossovers.size(), worst.value_or(0.0))});
}

bool trusted(const Result& result) {
  return std::none_of(result.findings.begin(), result.findings.end(),
                      [](const Finding& f) { return f.severity == Severity::error; });
}

}  // namespace resonid::identification::detail
