// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <identification/criteria.hpp>
#include <identification/identify/judge/judge.hpp>
#include <identification/identify/judge/loop.hpp>
#include <identification/identify/judge/modes.hpp>
#include <identification/identify/judge/reliability.hpp>
#include <identification/identify/judge/shown_modes.hpp>
#include <identification/identify/judge/validation.hpp>
#include <identification/identify/judge/without_structure.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <identification/progress.hpp>
#include <limits>
#include <resonid/fit/detail/response_modes.hpp>
#include <string_view>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;

/// By which a drive model is not even nearly the machine's.
constexpr std::array<std::string_view, 8> kGross = {"no-model",
                                                    "misfit",
                                                    "explains-nothing",
                                                    "unphysical-damping",
                                                    "mode-above-nyquist",
                                                    "response-shows-more",
                                                    "response-shows-less",
                                                    "uncertain-inertia"};

bool fails_grossly(const Result& result) {
  return std::any_of(result.findings.begin(), result.findings.end(), [](const Finding& f) {
    return f.severity == Severity::error && std::find(kGross.begin(), kGross.end(), f.id) != kGross.end();
  });
}

bool holds(const BlackBoxSelection& box, const data::FrequencyResponse& measured,
           const std::vector<fit::ResponseMode>& shown) {
  if (!box.result.converged || !box.result.stable || !(box.result.fit_percent > 0.0)) return false;
  const auto reached = within_reach(box.result.model, measured);
  if (reached.lines() == 0 || !(black_box_error(box.result.model, measured) <= kCriteria.misfit))
    return false;
  Result alone;
  alone.black_box = box.result;
  hold_against_response(reached, shown, alone);
  return alone.findings.empty();
}

/// Of the order that the hold-out data prefer, or a higher one that has what the response shows.
std::optional<BlackBoxSelection> box_that_holds(const Experiment& experiment, const Plan& plan,
                                                const Options& options,
                                                const data::FrequencyResponse& measured) {
  const BlackBoxBand band{options.band_hz ? options.band_hz : std::pair(plan.low_hz, plan.high_hz),
                          options.band_hz.has_value()};
  const auto shown = fit::response_modes(measured);
  constexpr std::size_t kStep = 2, kHighest = 12;
  Options of_order = options;
  for (;;) {
    auto box = select_black_box(experiment.record, of_order, band);
    if (!box) return std::nullopt;
    if (holds(*box, measured, shown)) return std::move(*box);
    of_order.order = box->result.model.transfer_function.denominator.size() - 1 + kStep;
    if (of_order.order > kHighest) return std::nullopt;
  }
}

std::vector<data::Mode> determined(std::vector<data::Mode> modes) {
  std::erase_if(modes, [](const data::Mode& m) {
    return !(m.frequency_hz.std < kCriteria.uncertain_resonance * m.frequency_hz.value) ||
           !(m.damping_ratio.value > 0.0 && m.damping_ratio.value < 0.5);
  });
  return modes;
}

void set_aside(Result& result) {
  for (auto& trial : result.structures) {
    if (!trial.chosen) continue;
    trial.chosen = false;
    trial.remark = "closest drive model, but it does not fit";
    if (result.model) trial.model = std::move(result.model);
  }
  result.model.reset();
}

}  // namespace

double reach_hz(const fit::BlackBoxModel& model) {
  constexpr double kReach = 0.4;
  return kReach / model.transfer_function.sample_time_s;
}

data::FrequencyResponse within_reach(const fit::BlackBoxModel& model,
                                     const data::FrequencyResponse& response) {
  return response.band(0.0, reach_hz(model));
}

double black_box_error(const fit::BlackBoxModel& model, const data::FrequencyResponse& response) {
  const auto lines = thinned(within_reach(model, response));
  if (lines.lines() == 0 || lines.std.size() != lines.lines()) return 0.0;
  return difference(model.response(lines.frequency_hz).value, lines).unexplained;
}

void put_black_box_instead(const Experiment& experiment, const Measurement& m, const Options& options,
                           Result& result) {
  const bool asked = options.model != ModelChoice::automatic || options.method == Method::model ||
                     options.friction != Friction::automatic || options.ground != Ground::automatic ||
                     options.torque_lag_s || options.output_filter_s;
  if (asked || experiment.motion || !experiment.record.input.present() || m.evidence.biased()) return;
  if (!fails_grossly(result) || !reliability_of(result).response) return;
  // A response by another controller than the one that ran is no drive's, nor a box's.
  if (options.approach == Approach::indirect &&
      std::any_of(result.findings.begin(), result.findings.end(), [](const auto& f) {
        return f.id == "controller-differs" && f.severity == Severity::error;
      }))
    return;
  tell(options, "fitting a black-box model");
  auto box = box_that_holds(experiment, m.plan, options, result.response);
  if (!box) return;
  set_aside(result);
  result.black_box = box->result;
  const auto order = box->result.model.transfer_function.denominator.size() - 1;
  // Its criterion is one of other samples.
  constexpr double kIncomparable = std::numeric_limits<double>::quiet_NaN();
  StructureTrial trial{
      fmt::format("black-box of order {}", order), 2 * order, kIncomparable, {}, {}, true, {}};
  for (const auto& t : box->structures)
    if (t.chosen) trial.parameters = t.parameters, trial.holdout_fit_percent = t.holdout_fit_percent;
  result.structures.push_back(std::move(trial));
  std::erase_if(result.choices, [](const Choice& c) { return c.what == "structure"; });
  result.choices.insert(result.choices.end(), box->choices.begin(), box->choices.end());
  result.findings.push_back(
      {"black-box-instead",
       Severity::info,
       static_cast<double>(order),
       {},
       fmt::format(
           "No drive model fits, for the reasons given as errors. A black box of order {} agrees with "
           "the measured response: it stands in the drive model's place, without inertias and "
           "stiffness. Resonances and margins are those of the response.",
           order)});
  // What the drive model, which does not hold, made of the response goes with it.
  const auto [low_hz, high_hz] = visible_modes_hz(m.plan);
  result.modes = determined(modes_of(fit::response_modes(result.response)));
  if (result.modes.empty()) result.modes = determined(modes_of(box->result.model, low_hz, high_hz));
  Fitted fitted;
  fitted.black_box = std::move(*box);
  result.residual.clear();
  result.residual_start = 0;
  put_validation(experiment.record, m.lines, std::move(fitted), result);
  result.roots = roots_of(result);
}

}  // namespace resonid::identification::detail
