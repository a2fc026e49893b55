// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/measure/loop_evidence.hpp>
#include <identification/identify/measure/orientation.hpp>
#include <identification/identify/measure/thinned.hpp>
#include <limits>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/fit/response_fit.hpp>
#include <resonid/response/line_estimates.hpp>
#include <vector>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;
using Complex = std::complex<double>;

/// Relative bias of every line, limited where the autoregression's own response nearly vanishes.
std::vector<Complex> biases(const diagnostics::Feedback& feedback, const std::vector<double>& hz) {
  std::vector<Complex> bias;
  for (const double f : hz) {
    const Complex b = feedback.direct_bias(f);
    const double size = std::abs(b);
    bias.push_back(!std::isfinite(size)         ? Complex(0.0)
                   : size > kCriteria.most_bias ? b * (kCriteria.most_bias / size)
                                                : b);
  }
  return bias;
}

std::string percent(double part) { return fmt::format("{:.0f} %", 100.0 * part); }

/// The gain at once of a told controller against the one that u and y show without excitation.
std::optional<Finding> inspect_gain(const data::TransferFunction& told,
                                    const diagnostics::Feedback& feedback) {
  const double expected = told.numerator.front() / told.denominator.front();
  const double shown = -feedback.d.front();
  const double deviation = std::sqrt(feedback.input_variance / (feedback.samples * feedback.output_variance));
  const double difference = std::abs(shown - expected);
  if (!(difference > kCriteria.controller_difference * std::abs(shown)) ||
      !(difference > kCriteria.controller_deviations * deviation))
    return std::nullopt;
  return Finding{
      "controller-differs", Severity::error, difference / std::abs(shown), kCriteria.controller_difference,
      fmt::format(
          "The input responds to output noise within one sample with a gain of {:.4g} +- "
          "{:.2g}, the controller given with {:.4g}: it is not the one that ran, and the "
          "margins are not those of this loop. Give the controller that ran (.controller), or leave it "
          "out.",
          shown, 2.0 * deviation, expected)};
}

}  // namespace

LoopEvidence loop_evidence(const data::Record& record, const Plan& plan, ExcitationSource source,
                           const Options& options, const data::FrequencyResponse& response) {
  LoopEvidence evidence;
  if (source == ExcitationSource::recorded && record.output_quantity == data::OutputQuantity::velocity)
    evidence.controller = fit::estimate_controller(record);
  if (plan.approach != Approach::direct) return evidence;
  auto feedback = diagnostics::find_feedback(record, options.delay_s);
  if (!feedback || !feedback->present()) return evidence;
  evidence.feedback = std::move(*feedback);
  std::vector<double> relative, bars;
  const auto bias = biases(*evidence.feedback, response.frequency_hz);
  for (std::size_t i = 0; i < bias.size(); ++i) {
    relative.push_back(std::abs(bias[i]));
    if (response.std.size() != bias.size()) continue;
    const double absolute = std::abs(bias[i] / (1.0 + bias[i]) * response.value[i]);
    bars.push_back(absolute / std::max(response.std[i], 1e-300));
  }
  evidence.bias = median(std::move(relative));
  evidence.bias_bars = median(std::move(bars));
  return evidence;
}

std::optional<fit::ControllerEstimate> predictor_controller(
    const std::optional<fit::ControllerEstimate>& shown, const Options& options) {
  if (!shown) return std::nullopt;
  const bool asked = options.approach == Approach::joint;
  const bool needed = !options.approach && shown->relative_noise > kCriteria.noisy_input;
  if (!asked && !needed) return std::nullopt;
  auto controller = *shown;
  controller.noise.clear();
  return controller;
}

data::FrequencyResponse without_bias(const data::FrequencyResponse& response, const LoopEvidence& evidence) {
  if (!evidence.biased() || response.std.size() != response.lines()) return response;
  auto corrected = response;
  const auto bias = biases(*evidence.feedback, response.frequency_hz);
  for (std::size_t i = 0; i < bias.size(); ++i) {
    const double scale = std::max(std::abs(1.0 + bias[i]), 1e-3);
    corrected.value[i] /= 1.0 + bias[i];
    corrected.std[i] = std::hypot(corrected.std[i] / scale,
                                  kCriteria.bias_uncertainty * std::abs(bias[i] * corrected.value[i]));
  }
  return corrected;
}

Choice controller_choice(const fit::ControllerEstimate& shown) {
  return {"controller", fmt::format("of order {}", shown.controller.denominator.size() - 1),
          shown.input_noise > 0.0
              ? fmt::format(
                    "u - ru = C (r - y) holds in the recording except for noise of {:.3g} rms on the input",
                    shown.input_noise)
              : std::string("u - ru = C (r - y) holds in the recording without any noise")};
}

Choice predictor_choice(const Options& options, const fit::ControllerEstimate& shown) {
  if (options.approach)
    return {"predictor", "closed loop with the identified controller", "joint was specified"};
  return {"predictor", "closed loop with the identified controller",
          fmt::format("the recorded input contains noise ({:.2g} % of the controller's output), which would "
                      "bias a simulation from it",
                      100.0 * shown.relative_noise)};
}

void downweight_incoherent(const LoopEvidence& evidence, std::vector<Finding>& findings) {
  if (!evidence.controller) return;
  for (auto& f : findings)
    if (f.id == "incoherent") {
      f.severity = Severity::warning;
      f.meaning += " The cause here is noise: the columns do belong to one loop, u - ru = C (r - y).";
    }
}

Choice model_choice(const LoopEvidence& evidence, Method measured) {
  return {"method", std::string(name_of(Method::model)),
          fmt::format("noise is fed back: the response by {} is typically biased by {}; the fit to the "
                      "recording models the noise and is not",
                      name_of(measured), percent(evidence.bias))};
}

std::optional<Finding> inspect_controller(const Options& options, const LoopEvidence& evidence,
                                          const data::FrequencyResponse& response) {
  if (!options.controller || response.lines() == 0) return std::nullopt;
  if (!evidence.controller)
    return evidence.feedback ? inspect_gain(*options.controller, *evidence.feedback) : std::nullopt;
  const auto& shown = *evidence.controller;
  std::vector<double> relative, bars;
  data::FrequencyResponse uncertain;
  if (shown.model) uncertain = shown.model->response(response.frequency_hz);
  for (std::size_t i = 0; i < response.lines(); ++i) {
    const Complex own = shown.controller.response(response.frequency_hz[i]);
    const double difference = std::abs(options.controller->response(response.frequency_hz[i]) - own);
    relative.push_back(difference / std::abs(own));
    bars.push_back(shown.model ? difference / uncertain.std[i] : std::numeric_limits<double>::infinity());
  }
  const double typical = median(std::move(relative));
  if (!(typical > kCriteria.controller_difference) ||
      !(median(std::move(bars)) > kCriteria.controller_deviations))
    return std::nullopt;
  const double middle = response.frequency_hz[response.lines() / 2];
  return Finding{
      "controller-differs", Severity::error, typical, kCriteria.controller_difference,
      fmt::format("The controller given is not the one that ran: it typically differs by {} from the "
                  "controller identified by u - ru = C (r - y) (gain at {:.3g} Hz: given {:.4g}, identified "
                  "{:.4g}). The margins are those of the identified controller. Give the right .controller, "
                  "or leave it "
                  "out.",
                  percent(typical), middle, std::abs(options.controller->response(middle)),
                  std::abs(shown.controller.response(middle)))};
}

std::optional<Finding> inspect_feedback(const LoopEvidence& evidence, bool from_model) {
  if (!evidence.feedback || !(evidence.bias > kCriteria.feedback_bias)) return std::nullopt;
  const std::string what = fmt::format(
      "A controller feeds the output's noise back to the input ({} of the output's innovation shows in the "
      "later input). This typically biases averaged spectra of input and output by {}",
      percent(evidence.feedback->seen), percent(evidence.bias));
  if (from_model)
    return Finding{
        "feedback-bias", Severity::info, evidence.bias, kCriteria.feedback_bias,
        what + ". The response given is that of the model fitted to the recording, which has no such bias."};
  const char* help =
      ". Record the excitation (ru), or give the controller and the reference, or allow a model (.model).";
  if (!evidence.biased())
    return Finding{"feedback-bias", Severity::warning, evidence.bias, kCriteria.feedback_bias,
                   what + ", which is within their error bars" + help};
  return Finding{"feedback-bias", Severity::error, evidence.bias, kCriteria.feedback_bias,
                 what + ", and with them the response given" + help};
}

std::optional<Finding> inspect_quantity(const data::Record& record, const data::FrequencyResponse& measured) {
  using data::OutputQuantity;
  // With the unit the reader assumed what the output is; what the file or the user tells is not doubted.
  if (!record.output.unit_assumed) return std::nullopt;
  const auto response = thinned(measured);
  const double step = record.sample_time_s();
  const auto error_of = [&](const data::FrequencyResponse& g, double lag_s) {
    double least = std::numeric_limits<double>::infinity();
    for (const auto structure : {fit::Structure::rigid, fit::Structure::two_mass}) {
      fit::ResponseFitConfig config;
      config.structure = structure;
      config.sample_time_s = step;
      config.delay = true;
      if (lag_s > 0.0) config.further = {fit::kTorqueLag};
      config.torque_lag_s = lag_s;
      const auto fitted = fit::fit_response(g, config);
      // A lag whose corner lies below the lines is an integrator to them.
      if (!fitted ||
          (lag_s > 0.0 && kTwoPi * g.frequency_hz.front() * fitted->model.value(fit::kTorqueLag) > 1.0))
        continue;
      least = std::min(least, fitted->model_error);
    }
    return least;
  };
  // A lag bends the response of a velocity towards that of a position.
  double as_told = error_of(response, 0.0);
  const double middle = kTwoPi * std::sqrt(response.frequency_hz.front() * response.frequency_hz.back());
  for (const double part : {0.3, 1.0, 3.0})
    if (as_told > kCriteria.quantity_fits) as_told = std::min(as_told, error_of(response, part / middle));
  if (!(as_told > kCriteria.quantity_fits)) return std::nullopt;
  for (const auto other :
       {OutputQuantity::velocity, OutputQuantity::position, OutputQuantity::acceleration}) {
    if (other == record.output_quantity) continue;
    auto converted = response;
    for (std::size_t i = 0; i < converted.lines(); ++i) {
      const Complex factor =
          response::velocity_factor(other, converted.frequency_hz[i], step) /
          response::velocity_factor(record.output_quantity, converted.frequency_hz[i], step);
      converted.value[i] *= factor;
      if (!converted.std.empty()) converted.std[i] *= std::abs(factor);
    }
    const double error = error_of(converted, 0.0);
    if (!(error < kCriteria.quantity_fits) || !(error < kCriteria.quantity_gain * as_told)) continue;
    const auto named = [](OutputQuantity q) {
      return fmt::format("{} {}", q == OutputQuantity::acceleration ? "an" : "a", name_of(q));
    };
    return Finding{
        "other-quantity", Severity::error, as_told, kCriteria.quantity_fits,
        fmt::format("{} answers as {} does, not as {} (a drive explains it to {:.1f} %, otherwise to "
                    "{:.0f} %): give .output_quantity {}.",
                    record.output.name, named(other), named(record.output_quantity), 100.0 * error,
                    100.0 * std::min(as_told, 9.99), name_of(other))};
  }
  return std::nullopt;
}

std::optional<Finding> inspect_orientation(const LoopEvidence& evidence,
                                           const data::FrequencyResponse& response) {
  if (evidence.biased()) return std::nullopt;
  const auto finding = [](const char* id, std::string meaning) {
    return Finding{id, Severity::error, {}, {}, std::move(meaning)};
  };
  const auto found = orientation_of(response);
  switch (found.orientation) {
    case Orientation::unknown:
    case Orientation::drive:
      return std::nullopt;
    case Orientation::grounded:
      return finding(
          "spring-to-ground",
          fmt::format("Below {:.3g} Hz the velocity leads by about 90 deg and grows with frequency, "
                      "above {:.3g} Hz it falls and lags as that of a free drive: a spring to ground "
                      "(flexure, gravity, gas spring) or a position loop holds the machine. A model "
                      "without that spring is not reliable. Give .ground motor or .ground load.",
                      found.low_hz, found.high_hz));
    case Orientation::inverse:
      return finding("reversed",
                     "At low frequencies the response leads by about 90 deg and grows with frequency, as the "
                     "inverse of a drive does: input and output columns are exchanged (.input, .output).");
    case Orientation::mirrored:
      break;
  }
  const bool against = evidence.controller && evidence.controller->controller.numerator.front() < 0.0;
  return finding(
      "reversed",
      fmt::format("At low frequencies the output leads the input by about 90 deg instead of lagging{}: the "
                  "sign of the encoder or of the torque is reversed. Try .output_scale -1.",
                  against ? ", and the controller, u - ru = C (r - y), has a negative gain" : ""));
}

}  // namespace resonid::identification::detail
