// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <identification/criteria.hpp>
#include <identification/identify/judge/bending.hpp>
#include <identification/identify/judge/judge.hpp>
#include <identification/identify/judge/loop.hpp>
#include <identification/identify/judge/modes.hpp>
#include <identification/identify/judge/planned_loop.hpp>
#include <identification/identify/judge/reliability.hpp>
#include <identification/identify/judge/root_cause.hpp>
#include <identification/identify/judge/second_output.hpp>
#include <identification/identify/judge/shown_modes.hpp>
#include <identification/identify/judge/trust.hpp>
#include <identification/identify/judge/validation.hpp>
#include <identification/identify/judge/weak_excitation.hpp>
#include <identification/identify/judge/without_structure.hpp>
#include <identification/identify/select/simulate_and_correct.hpp>
#include <resonid/base/detail/statistics.hpp>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

bool in_motion(const Fitted& fitted) { return fitted.drive && fitted.drive->in_motion; }

bool biased_without_model(const Measurement& m, const Fitted& fitted, const Options& options) {
  return options.method == Method::automatic && fitted.to_record() &&
         (m.evidence.biased() || in_motion(fitted));
}

Method reported_method(const Measurement& m, const Fitted& fitted, const Options& options) {
  if (biased_without_model(m, fitted, options)) return Method::model;
  const bool with_model = options.method == Method::model || options.method == Method::simulate_and_correct;
  return with_model ? options.method : m.plan.method;
}

void replace(std::vector<Choice>& choices, Choice by) {
  const auto same =
      std::find_if(choices.begin(), choices.end(), [&](const Choice& c) { return c.what == by.what; });
  if (same != choices.end()) *same = std::move(by);
}

std::vector<Choice> choices_of(const Experiment& experiment, const Measurement& m, const Fitted& fitted,
                               const Options& options) {
  auto choices = experiment.choices;
  if (m.method) replace(choices, *m.method);
  if (m.resolution) choices.push_back(*m.resolution);
  choices.insert(choices.end(), fitted.choices.begin(), fitted.choices.end());
  if (in_motion(fitted) && options.method == Method::automatic)
    replace(choices,
            {"method", "model", "a motion profile excites few frequencies, and friction is in them"});
  else if (biased_without_model(m, fitted, options))
    replace(choices, model_choice(m.evidence, m.plan.method));
  if (m.plan.loop_controller && fitted.to_record())
    choices.push_back(predictor_choice(options, *m.evidence.controller));
  return choices;
}

/// Whether a spring to the ground is why the velocity leads at low frequencies: the model that has it holds,
/// and the lines reach well beyond its modes, where they would not lag if input and output were exchanged.
bool explains_lead(const ModelResult& model, const data::FrequencyResponse& response) {
  constexpr double kBeyond = 1.2;
  if (!model.drive.grounded() || !(model.model_error < kCriteria.misfit)) return false;
  const auto modes = model.drive.modes();
  if (modes.empty()) return false;
  double known_hz = 0.0;
  for (std::size_t i = 0; i < response.lines(); ++i)
    if (!response.std.empty() && response.std[i] < kCriteria.orientation_line * std::abs(response.value[i]))
      known_hz = response.frequency_hz[i];
  return modes.back().frequency_hz.value * kBeyond < known_hz;
}

std::vector<Finding> findings_of(const Experiment& experiment, const Measurement& m, const Fitted& fitted,
                                 const Options& options) {
  auto findings = experiment.findings;
  findings.insert(findings.end(), m.findings.begin(), m.findings.end());
  // The response that is reported is the model's.
  if (in_motion(fitted) && options.method == Method::automatic)
    for (auto& finding : findings)
      if (finding.id == "incoherent" || finding.id == "reversed" || finding.id == "controller-differs")
        finding.severity = Severity::info;
  if (fitted.black_box) inspect_black_box(fitted.black_box->result, findings);
  if (fitted.to_record()) downweight_incoherent(m.evidence, findings);
  // A black box may have such a pair of poles, a drive model the spring.
  if (fitted.black_box || (fitted.drive && fitted.drive->result.drive.grounded()))
    for (auto& f : findings)
      if (f.id == "spring-to-ground") f.severity = Severity::info;
  if (fitted.drive && explains_lead(fitted.drive->result, m.response))
    std::erase_if(findings, [](const Finding& f) { return f.id == "reversed"; });
  const bool of_model = biased_without_model(m, fitted, options) || options.method == Method::model;
  if (auto feedback = inspect_feedback(m.evidence, of_model)) findings.push_back(std::move(*feedback));
  return findings;
}

std::vector<data::Mode> modes_of_model(const Measurement& m, const Result& result) {
  if (result.model) return result.model->drive.modes();
  const auto [low_hz, high_hz] = visible_modes_hz(m.plan);
  if (result.black_box) return modes_of(result.black_box->model, low_hz, high_hz);
  return {};
}

/// A mode of a black box that nothing determines is none; a box of such modes only is not to be trusted.
void discard_undetermined(Result& result) {
  std::size_t resonances = 0, kept = 0;
  for (const auto& mode : result.modes) resonances += mode.anti ? 0 : 1;
  std::erase_if(result.modes, [](const data::Mode& mode) {
    return !(mode.frequency_hz.std < kCriteria.determined_mode * mode.frequency_hz.value);
  });
  for (const auto& mode : result.modes) kept += mode.anti ? 0 : 1;
  if (resonances > 0 && kept == 0)
    result.findings.push_back(
        {"uncertain-resonance",
         Severity::error,
         {},
         kCriteria.determined_mode,
         "The black box has resonances, but the recording determines none of them: excite "
         "more strongly or record "
         "longer, or take a lower .order."});
}

void inspect_black_box_error(Result& result) {
  const double error = black_box_error(result.black_box->model, result.response);
  if (!(error > kCriteria.misfit)) return;
  const bool bad = error > kCriteria.worthless;
  result.findings.push_back(
      {"misfit", bad ? Severity::error : Severity::warning, error,
       bad ? kCriteria.worthless : kCriteria.misfit,
       fmt::format("Black box and measured response typically differ by {:.0f} % beyond the noise: take a "
                   "higher .order, or a narrower .band_hz.",
                   100.0 * error)});
}

/// What model and response say of each other's modes. Where they differ it may be the method: a fast sweep
/// smears a sharp resonance, short segments a deep dip. Then the response is judged as it comes from the
/// model by the same method.
void hold_against_measured(const Experiment& experiment, const Measurement& m, const Options& options,
                           Result& result) {
  const auto judged_by = [&](const data::FrequencyResponse& response) {
    Result judged = result;
    hold_against_response(response, fit::response_modes(response), judged);
    return judged;
  };
  Result judged =
      judged_by(result.black_box ? within_reach(result.black_box->model, result.response) : result.response);
  const bool contradicted = std::any_of(judged.findings.begin(), judged.findings.end(), [](const Finding& f) {
    return f.id == "response-shows-more" || f.id == "response-shows-less";
  });
  if (contradicted && result.model && result.model->from_record && experiment.record.input.present()) {
    const Measure measure = [&](const data::Record& r) { return measure_response(r, m.plan, options); };
    const auto corrected = corrected_response(experiment.record, result.response, *result.model,
                                              options.delay_s, measure, Uncertainty::of_measurement);
    if (corrected) judged = judged_by(*corrected);
  }
  result = std::move(judged);
}

/// A told controller against what the lines show of it, where u and y by themselves show none: the output may
/// be late, held or filtered between the controller and the record.
std::optional<Finding> inspect_told_controller(const Measurement& m, const Options& options) {
  if (!options.controller || m.evidence.controller || m.plan.approach != Approach::joint ||
      m.lines.output_quantity != data::OutputQuantity::velocity)
    return std::nullopt;
  const auto shown = response::controller_response(m.lines);
  if (!shown || shown->std.size() != shown->lines()) return std::nullopt;
  std::vector<double> relative, bars;
  for (std::size_t i = 0; i < shown->lines(); ++i) {
    const double size = std::abs(shown->value[i]);
    if (!(shown->std[i] < kCriteria.margin_line * size)) continue;
    const double difference =
        std::abs(options.controller->response(shown->frequency_hz[i]) - shown->value[i]);
    relative.push_back(difference / size);
    bars.push_back(difference / std::max(shown->std[i], 1e-300));
  }
  constexpr std::size_t kFewest = 5;
  if (relative.size() < kFewest) return std::nullopt;
  const double typical = median(std::move(relative));
  if (!(typical > kCriteria.controller_difference) ||
      !(median(std::move(bars)) > kCriteria.controller_deviations))
    return std::nullopt;
  return Finding{
      "controller-differs", Severity::error, typical, kCriteria.controller_difference,
      fmt::format("What input and excitation show of the controller, (Ru - U)/Y, typically differs by {:.0f} "
                  "% from the one given: another one ran, or the recorded output is not what it was fed "
                  "(late, filtered, sampled and held). Give the right .controller, or leave it out. The "
                  "margins are not those of the loop.",
                  100.0 * typical)};
}

/// What constancy found too is told once, by its cause.
void include(std::vector<Finding>& bending, Result& result) {
  for (auto& b : bending) {
    const auto same = std::find_if(result.findings.begin(), result.findings.end(),
                                   [&](const Finding& f) { return f.id == b.id; });
    if (same == result.findings.end()) {
      result.findings.push_back(std::move(b));
    } else if (b.severity == Severity::error || same->severity != Severity::error) {
      *same = std::move(b);
    }
  }
}

void judge_loop(const Measurement& m, const Options& options, bool of_motion, Result& result) {
  if (of_motion) return;  // few frequencies, which say nothing of the loop
  if (auto loop = response::loop_response(m.lines)) result.measured_loop = std::move(*loop);
  const Options real = with_real_controller(m, options);
  const bool identified = m.evidence.controller && (!options.controller || m.controller_differs);
  if (identified) result.choices.push_back(controller_choice(*m.evidence.controller));
  // What stands for a drive model that does not hold is no better than the response.
  const bool instead = options.model == ModelChoice::automatic && result.black_box;
  const auto model = instead ? PlantModel() : plant_model(result);
  result.loop = loop_of(m.plan, real, m.lines, result.response, model);
  if (result.loop)
    if (auto finding = keep_to_band(m.plan, identified, *result.loop))
      result.findings.push_back(std::move(*finding));
  if (identified && result.loop) {
    const auto loop_with = [&, plant = plain(model)](const data::TransferFunction& controller) {
      Options other = real;
      other.controller = controller;
      return loop_of(m.plan, other, m.lines, result.response, plant);
    };
    include_controller(*m.evidence.controller, loop_with, *result.loop);
  }
  if (auto differs = inspect_told_controller(m, options)) result.findings.push_back(std::move(*differs));
  inspect_loop(result);
  if (options.planned_controller) judge_planned_loop(m, options, model, result);
}

/// Stands first. What says nothing of the machine is shown as it was measured.
void put_weak_excitation(const Experiment& experiment, const Measurement& m, Finding weak, Result& result) {
  if (drowns_everything(weak) && result.method == name_of(Method::model)) {
    result.method = name_of(m.plan.method);
    for (const auto& choice : experiment.choices)
      if (choice.what == "method") replace(result.choices, choice);
    if (m.method) replace(result.choices, *m.method);
  }
  result.findings.insert(result.findings.begin(), std::move(weak));
}

}  // namespace

Options with_real_controller(const Measurement& measurement, const Options& options) {
  Options real = options;
  const auto& shown = measurement.evidence.controller;
  if (shown && (!options.controller || measurement.controller_differs)) real.controller = shown->controller;
  return real;
}

std::pair<double, double> visible_modes_hz(const Plan& plan) {
  return {kCriteria.lower_mode * plan.low_hz, kCriteria.upper_mode * plan.high_hz};
}

Result judge(const Experiment& experiment, const Measurement& m, Fitted fitted, const Options& options) {
  Result result;
  result.record = experiment.facts;
  result.units = experiment.units;
  result.method = name_of(reported_method(m, fitted, options));
  result.approach = name_of(m.plan.approach);
  result.confidence = options.confidence;
  result.known_delay_s = options.delay_s;
  result.radius_m = options.radius_m;
  result.response = fitted.corrected ? *fitted.corrected : m.response;
  result.distortion = m.distortion;
  result.choices = choices_of(experiment, m, fitted, options);
  result.findings = findings_of(experiment, m, fitted, options);
  result.structures = std::move(fitted.structures);
  std::vector<Finding> bending;
  if (fitted.drive) bending = inspect_bending(experiment, m, options, *fitted.drive);
  auto of_second = fit_to_second_output(experiment, m, options, fitted.drive, result);
  if (fitted.drive) result.model = fitted.drive->result;
  if (fitted.black_box) result.black_box = fitted.black_box->result;
  if (!fitted.black_box) inspect_model(m.plan, options, fitted.drive, result);
  include(bending, result);
  for (auto& finding : of_second) result.findings.push_back(std::move(finding));
  const bool of_motion = in_motion(fitted) && fitted.drive->result.drive.structure == fit::Structure::rigid;
  put_validation(experiment.record, m.lines, std::move(fitted), result);
  inspect_validation(result);
  result.modes = modes_of_model(m, result);
  if (result.black_box) discard_undetermined(result);
  if (result.black_box && !m.evidence.biased()) inspect_black_box_error(result);
  if (!m.evidence.biased() && !of_motion) hold_against_measured(experiment, m, options, result);
  result.roots = roots_of(result);
  put_black_box_instead(experiment, m, options, result);
  if (result.second_output && !result.model) result.second_output->fitted = false;
  judge_loop(m, options, of_motion, result);
  if (auto weak = inspect_excitation(experiment, m, options, result))
    put_weak_excitation(experiment, m, std::move(*weak), result);
  return result;
}

void conclude(const Options& options, Result& result) {
  if (result.method == name_of(Method::model)) {
    auto coherence = std::move(result.response.coherence);
    const auto f = result.response.frequency_hz;
    result.response = result.model ? result.model->drive.response(f) : result.black_box->model.response(f);
    result.response.coherence = std::move(coherence);
  }
  result.trusted = trusted(result);
  result.reliable = reliability_of(result);
  keep_root_cause(options.model == ModelChoice::automatic, result);
}

}  // namespace resonid::identification::detail
