// SPDX-License-Identifier: MIT
#pragma once

#include <identification/identify/prepare/excitation_source.hpp>
#include <identification/identify/prepare/plan.hpp>
#include <optional>
#include <resonid/diagnostics/detail/feedback.hpp>
#include <resonid/fit/detail/controller_estimate.hpp>
#include <resonid/identification/result.hpp>

namespace resonid::identification::detail {

/// What a record shows of the loop it was taken in, before any model of the drive.
struct LoopEvidence {
  std::optional<fit::ControllerEstimate> controller;  ///< Of a velocity with recorded excitation.
  std::optional<diagnostics::Feedback> feedback;      ///< Of the direct approach, where it is present.
  double bias = 0.0;       ///< Of the measured direct response by it, typical line, relative to the truth.
  double bias_bars = 0.0;  ///< The same over the line's standard deviation.

  /// Whether the bias is more than 10 % and beyond the error bars.
  [[nodiscard]] bool biased() const noexcept { return bias > 0.1 && bias_bars > 1.0; }
};

[[nodiscard]] LoopEvidence loop_evidence(const data::Record& record, const Plan& plan,
                                         ExcitationSource source, const Options& options,
                                         const data::FrequencyResponse& response);

/// The controller that the model's predictor needs, if it is to be the one of the closed loop: the joint
/// approach was asked for, or none was and the recorded input is noisy, by which the open-loop predictor
/// would be biased (errors in variables).
[[nodiscard]] std::optional<fit::ControllerEstimate> predictor_controller(
    const std::optional<fit::ControllerEstimate>& shown, const Options& options);

/// A direct response without the bias of the feedback, as far as a high-order autoregression tells it; the
/// standard deviations hold a third of what was taken out. As it is, without bias.
[[nodiscard]] data::FrequencyResponse without_bias(const data::FrequencyResponse& response,
                                                   const LoopEvidence& evidence);

/// Why the margins are those of the identified controller.
[[nodiscard]] Choice controller_choice(const fit::ControllerEstimate& shown);
/// Why the model is simulated in its loop.
[[nodiscard]] Choice predictor_choice(const Options& options, const fit::ControllerEstimate& shown);
/// Why the model's response stands in place of the one measured by that method.
[[nodiscard]] Choice model_choice(const LoopEvidence& evidence, Method measured);

/// Few coherent lines are no ground to mistrust a fit to a record that shows its own loop.
void downweight_incoherent(const LoopEvidence& evidence, std::vector<diagnostics::Finding>& findings);

/// Whether the controller given is not the identified one: beyond error bars and 5 %.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_controller(const Options& options,
                                                                     const LoopEvidence& evidence,
                                                                     const data::FrequencyResponse& response);

/// What feedback means for the result; `from_model`: the response is the model's.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_feedback(const LoopEvidence& evidence,
                                                                   bool from_model);

/// An output that is another quantity than it is called, a position for a velocity: rigid and two-mass drives
/// do not describe its response, and describe it well when it is taken for that other one.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_quantity(const data::Record& record,
                                                                   const data::FrequencyResponse& response);

/// A mirrored signal, input and output exchanged, or a spring to ground, by a response that leads at low
/// frequencies: exchanged columns also do at high ones, a machine on a spring lags there.
[[nodiscard]] std::optional<diagnostics::Finding> inspect_orientation(
    const LoopEvidence& evidence, const data::FrequencyResponse& response);

}  // namespace resonid::identification::detail
