// SPDX-License-Identifier: MIT
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <identification/criteria.hpp>
#include <identification/identify/judge/constancy.hpp>
#include <identification/identify/judge/second_output.hpp>
#include <identification/identify/prepare/units.hpp>
#include <identification/identify/select/drive_candidate.hpp>
#include <identification/identify/select/record_fit.hpp>
#include <resonid/base/constants.hpp>
#include <resonid/base/detail/statistics.hpp>
#include <resonid/data/detail/second_output.hpp>
#include <resonid/fit/detail/second_output.hpp>
#include <resonid/fit/output_error.hpp>
#include <string_view>

namespace resonid::identification::detail {
namespace {

using diagnostics::Finding;
using diagnostics::Severity;
using fit::SecondOutputFit;

std::string unit_of_response(const data::Record& record) {
  data::Record units;
  units.input.unit = record.input.unit;
  units.output.unit = record.second_output.unit;
  units.output_quantity = data::quantity_of(record.second_output_kind);
  units.motion = record.motion;
  return units_of(units).response;
}

std::string_view name_of_kind(data::SecondOutput kind) {
  return kind == data::SecondOutput::load_encoder ? "load encoder" : "load accelerometer";
}

double tolerance_of(data::SecondOutput kind) {
  return kind == data::SecondOutput::load_encoder ? kCriteria.encoder_scale : kCriteria.accelerometer_scale;
}

bool off(const data::Estimate& e, double expected, double least) {
  const double by = std::abs(e.value - expected);
  return by > kCriteria.second_output_deviations * e.std && by > least;
}

/// Segments that resolve the sharpest mode, a few of them at least.
std::size_t segments_for(const fit::DriveModel& model, const data::Record& record) {
  constexpr double kLinesPerWidth = 4.0;
  constexpr std::size_t kShortest = 64, kFewest = 4;
  double wanted = static_cast<double>(kShortest);
  for (const auto& mode : model.modes()) {
    const double width_hz = 2.0 * mode.damping_ratio.value * mode.frequency_hz.value;
    if (width_hz > 0.0) wanted = std::max(wanted, kLinesPerWidth * record.sample_rate_hz / width_hz);
  }
  const std::size_t most = std::bit_floor(std::max(kShortest, record.samples() / kFewest));
  return std::bit_ceil(static_cast<std::size_t>(std::min(wanted, static_cast<double>(most))));
}

/// What the method measures of the second output less `gain` times its simulation by the model, and the model
/// again: no leakage of what the model knows, and no smoothing of it, is in the lines then.
std::optional<data::FrequencyResponse> corrected(const Experiment& experiment, const Measurement& m,
                                                 const Options& options, fit::DriveModel model, double gain) {
  const auto kind = experiment.record.second_output_kind;
  auto record = data::with_second_output(experiment.record);
  for (double& sample : record.output.samples) sample /= gain;
  model.velocity = fit::Velocity::sampled;
  model.output_filter_s = 0.0;
  model.estimated[fit::kOutputFilter] = false;
  fit::OutputErrorConfig config;
  config.initial = model;
  config.fixed_model = config.at_load = true;
  config.noise_model = false;
  config.known_delay_s = options.delay_s;
  const auto simulated = fit::fit_output_error(record, config);
  if (!simulated) return std::nullopt;
  std::vector<double> left(record.samples(), 0.0);
  std::copy(simulated->residual.rbegin(), simulated->residual.rend(), left.rbegin());
  auto response =
      load_response(experiment.record, std::move(left), segments_for(model, experiment.record), m, options);
  if (!response || response->lines() == 0) return std::nullopt;
  response->smoothing = {};
  const auto known = fit::load_values(model, kind, response->frequency_hz);
  for (std::size_t i = 0; i < response->lines(); ++i) {
    response->value[i] = gain * (response->value[i] + known[i]);
    response->std[i] *= std::abs(gain);
  }
  return thinned(*response);
}

/// A fit to both outputs, and what of the second one it was fitted to.
struct Both {
  SecondOutputFit fit;
  fit::SecondOutputConfig config;
  data::FrequencyResponse lines;
};

std::optional<SecondOutputFit> fitted(const fit::DriveModel& first, const Both& both) {
  auto fit = fit::fit_second_output(first, both.lines, both.config);
  if (!fit) return std::nullopt;
  return std::move(*fit);
}

/// Whether no parameter moves by more than a part of its error bar.
bool settled(const fit::DriveModel& before, const fit::DriveModel& after) {
  constexpr double kPart = 0.1;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    const auto p = static_cast<fit::Parameter>(i);
    if (after.estimated[static_cast<std::size_t>(i)] &&
        std::abs(after.value(p) - before.value(p)) > kPart * after.estimate(p).std)
      return false;
  }
  return true;
}

/// Fit and correction in turns, from `model`: segments smear what the correction does not know yet, too.
bool iterate(const Experiment& experiment, const Measurement& m, const Options& options,
             const fit::DriveModel& first, fit::DriveModel& model, Both& both) {
  constexpr int kRounds = 5;
  for (int round = 0; round < kRounds; ++round) {
    if (auto lines = corrected(experiment, m, options, model, both.fit.gain.value))
      both.lines = std::move(*lines);
    auto fit = fitted(first, both);
    if (!fit) return false;
    both.fit = std::move(*fit);
    if (both.fit.model_error > kCriteria.worthless) continue;
    const bool done = settled(model, both.fit.model);
    model = both.fit.model;
    if (done) break;
  }
  return true;
}

/// With the factor and the delay that the second output shows beyond doubt, and no other.
std::optional<Both> fitted_to_both(const Experiment& experiment, const Measurement& m, const Options& options,
                                   const fit::DriveModel& first) {
  const auto kind = experiment.record.second_output_kind;
  Both both{{}, {kind, true, true}, thinned(*m.second_response)};
  const auto rough = fitted(first, both);
  if (!rough) return std::nullopt;
  constexpr double kNear = 0.25;  // of 1, and what leakage may do to the factor
  if (std::abs(rough->gain.value - 1.0) > kNear) both.fit.gain = rough->gain;
  fit::DriveModel model = first;
  if (!iterate(experiment, m, options, first, model, both)) return std::nullopt;
  both.config.gain = off(both.fit.gain, 1.0, kCriteria.noticeable_scale);
  both.config.delay = off(both.fit.delay_s, 0.0, kCriteria.noticeable_lateness * first.sample_time_s);
  if (both.config.gain && both.config.delay) return both;
  if (!both.config.gain) both.fit.gain = {1.0, 0.0};
  if (!iterate(experiment, m, options, first, model, both)) return std::nullopt;
  return both;
}

/// What makes such a factor.
std::string cause_of(double gain) {
  struct Known {
    double factor;
    const char* words;
  };
  constexpr double kGravity = 9.80665;
  constexpr std::array kFactors = {Known{180.0 / kPi, "it is in degrees, not in radians"},
                                   Known{1.0 / kTwoPi, "it is in turns, not in radians"},
                                   Known{1e3, "it is in thousandths of the unit"},
                                   Known{1e-3, "it is in thousands of the unit"},
                                   Known{1.0 / kGravity, "it is in g, not in m/s2"},
                                   Known{1.0, "its sign is wrong"}};
  for (const auto& known : kFactors)
    if (std::abs(std::abs(gain) / known.factor - 1.0) < kCriteria.encoder_scale)
      return gain < 0.0 && known.factor != 1.0 ? fmt::format("{}, and its sign is wrong", known.words)
                                               : known.words;
  return gain < 0.0 ? "its sign is wrong, and a gear ratio or a scale is missing"
                    : "a gear ratio or a scale is missing or wrong";
}

Finding scale_finding(data::SecondOutput kind, const data::Estimate& gain) {
  const double by = std::abs(gain.value - 1.0), most = tolerance_of(kind);
  if (by <= most)
    return {"second-output-scale", Severity::info, by, most,
            fmt::format("The {} shows {:.4g} times the motion that input and output let expect of the load "
                        "(standard deviation {:.2g}). The factor was estimated with the model.",
                        name_of_kind(kind), gain.value, gain.std)};
  return {
      "second-output-scale", Severity::error, by, most,
      fmt::format("The {} shows {:.4g} times the motion that input and output let expect of the load: {}. "
                  "Multiply .second_output_scale by {:.5g}, or mend the scale of input and output.",
                  name_of_kind(kind), gain.value, cause_of(gain.value), 1.0 / gain.value)};
}

Finding late_finding(data::SecondOutput kind, const data::Estimate& delay_s) {
  return {"second-output-late", Severity::info, delay_s.value, 0.0,
          fmt::format("The {} comes {:.3g} ms {} than the output (standard deviation {:.2g} ms). This was "
                      "estimated with the model.",
                      name_of_kind(kind), 1e3 * std::abs(delay_s.value),
                      delay_s.value > 0.0 ? "later" : "earlier", 1e3 * delay_s.std)};
}

/// Largest relative change of an inertia or a stiffness.
double largest_move(const fit::DriveModel& from, const fit::DriveModel& to) {
  double largest = 0.0;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (!from.estimated[static_cast<std::size_t>(i)] || !essential(i)) continue;
    const auto p = static_cast<fit::Parameter>(i);
    largest = std::max(largest, std::abs(to.value(p) / from.value(p) - 1.0));
  }
  return largest;
}

/// Below this frequency the load follows the driven side.
double following_hz(const fit::DriveModel& model, const data::FrequencyResponse& response) {
  constexpr double kFollows = 0.5;
  if (const auto modes = model.modes(); !modes.empty()) return kFollows * modes.front().frequency_hz.value;
  return std::sqrt(response.frequency_hz.front() * response.frequency_hz.back());
}

Finding differs(data::SecondOutput kind, double value, double most, std::string why) {
  return {"second-output-differs", Severity::error, value, most,
          fmt::format("The {} contradicts the model of input and output: {} The model is that of the output "
                      "alone. Check column, scale and mount of the second output.",
                      name_of_kind(kind), why)};
}

std::vector<std::complex<double>> expected_by(const SecondOutputFit& fit, data::SecondOutput kind,
                                              const data::FrequencyResponse& response) {
  fit::DriveModel late = fit.model;
  late.delay_s += fit.delay_s.value;
  auto expected = fit::load_values(late, kind, response.frequency_hz);
  for (auto& v : expected) v *= fit.gain.value;
  return expected;
}

Finding misfit_finding(data::SecondOutput kind, const SecondOutputFit& fit, double error,
                       const data::FrequencyResponse& response) {
  const auto expected = expected_by(fit, kind, response);
  const double follows_hz = following_hz(fit.model, response);
  std::vector<double> low;
  for (std::size_t i = 0; i < response.lines() && response.frequency_hz[i] < follows_hz; ++i) {
    const double size = std::abs(response.value[i]);
    if (response.std[i] < kCriteria.orientation_line * size)
      low.push_back(std::abs(response.value[i] - expected[i]) / size);
  }
  constexpr std::size_t kFewest = 3;
  const bool of_low = low.size() >= kFewest && median(std::move(low)) > kCriteria.misfit;
  return differs(
      kind, error, kCriteria.misfit,
      fmt::format("they typically differ by {:.0f} %{}.", 100.0 * error,
                  of_low ? fmt::format(", below {:.3g} Hz too, where the load has to follow the motor: "
                                       "it slips, or the column measures something else",
                                       follows_hz)
                         : fmt::format(" beyond {:.3g} Hz: between the two outputs is a compliance or a mass "
                                       "that the model lacks, or the sensor's mount gives way",
                                       follows_hz)));
}

/// Parameters that the second output moves by more than the output's error bars allow: the bars then hold it.
std::optional<Finding> inspect_contradiction(data::SecondOutput kind, const fit::DriveModel& first,
                                             SecondOutputFit& fit) {
  if (!(chi_square_tail(fit.contradiction, fit.directions) < kCriteria.constancy_false_alarm))
    return std::nullopt;
  const double moved = largest_move(first, fit.model);
  if (moved > kCriteria.correctable_shift)
    return differs(kind, moved, kCriteria.correctable_shift,
                   fmt::format("it moves an inertia or a stiffness by {:.2g} %, far beyond the error bars.",
                               100.0 * moved));
  fit::ParameterVector shift = fit::ParameterVector::Zero();
  for (int i = 0; i < fit::kParameterCount; ++i)
    if (first.estimated[static_cast<std::size_t>(i)])
      shift(i) =
          fit.model.value(static_cast<fit::Parameter>(i)) - first.value(static_cast<fit::Parameter>(i));
  fit.model.covariance += shift * shift.transpose();
  return Finding{
      "second-output-differs", Severity::info, moved, kCriteria.correctable_shift,
      fmt::format("The {} moves inertias and stiffness by up to {:.2g} %, more than the error bars "
                  "of the output alone. The error bars include that difference.",
                  name_of_kind(kind), 100.0 * moved)};
}

/// What is judged by the simulated output is that of the model of both, if it is no worse than that of the
/// output alone.
std::optional<Finding> take_simulation(data::SecondOutput kind, const ModelResult& of_both,
                                       const data::Record& record, const Options& options,
                                       Selection& selection) {
  if (selection.residual.empty()) return std::nullopt;
  const auto simulated = simulation_by(of_both, record, options.delay_s);
  if (!simulated) return std::nullopt;
  const auto left = [](double fit_percent) { return std::max(1e-9, 100.0 - fit_percent); };
  const double more = left(simulated->fit_percent) / left(selection.fit_percent) - 1.0;
  if (more > kCriteria.misfit)
    return differs(kind, more, kCriteria.misfit,
                   fmt::format("with it the residual is {:.0f} % larger.", 100.0 * more));
  selection.residual = simulated->residual;
  selection.residual_start = simulated->first_sample;
  selection.fit_percent = simulated->fit_percent;
  if (selection.fit_percents.size() == 1) selection.fit_percents = {simulated->fit_percent};
  return std::nullopt;
}

}  // namespace

std::vector<Finding> fit_to_second_output(const Experiment& experiment, const Measurement& m,
                                          const Options& options, std::optional<Selection>& selection,
                                          Result& result) {
  if (!m.second_response) return {};
  const auto kind = experiment.record.second_output_kind;
  auto& second = result.second_output.emplace();
  second.kind = kind;
  second.signal = experiment.record.second_output.name;
  second.unit = unit_of_response(experiment.record);
  second.response = *m.second_response;
  if (!selection) return {};
  if (selection->in_motion)
    return {{"second-output-unused",
             Severity::info,
             {},
             {},
             "The model is one of the motion, whose few frequencies give no response: it is that of the "
             "output alone. Excite more frequencies to use both."}};
  auto& model = selection->result;
  auto both = fitted_to_both(experiment, m, options, model.drive);
  if (!both || !both->fit.converged)
    return {
        {"second-output-unused",
         Severity::warning,
         {},
         {},
         "No fit to both outputs succeeded: the model is that of the output alone. Check column and scale "
         "(.second_output, .second_output_scale)."}};
  auto& fit = both->fit;
  // The middle line for the typical error; what a few lines miss by shows in the mean.
  const double typical = difference(expected_by(fit, kind, both->lines), both->lines).unexplained;
  const double error = fit.model_error > kCriteria.worthless ? fit.model_error : typical;
  second.model_error = error;
  std::vector<Finding> findings;
  if (both->config.gain && !off(fit.gain, 0.0, kCriteria.unrelated_scale))
    return {differs(
        kind, std::abs(fit.gain.value), kCriteria.unrelated_scale,
        "it is hardly correlated with the input. The column is another signal, or its sensor measures "
        "nothing.")};
  if (both->config.gain) {
    second.gain = fit.gain;
    findings.push_back(scale_finding(kind, fit.gain));
  }
  if (both->config.delay) {
    second.delay_s = fit.delay_s;
    findings.push_back(late_finding(kind, fit.delay_s));
  }
  if (error > kCriteria.misfit) {
    second.gain.reset();
    second.delay_s.reset();
    return {misfit_finding(kind, fit, error, both->lines)};
  }
  auto contradiction = inspect_contradiction(kind, model.drive, fit);
  const bool refused = contradiction && contradiction->severity == Severity::error;
  if (contradiction) findings.push_back(std::move(*contradiction));
  if (refused) {  // nor is the factor of a model that is not told
    second.gain.reset();
    second.delay_s.reset();
    return {std::move(findings.back())};
  }
  auto of_both = model;
  of_both.drive = fit.model;
  if (auto worse = take_simulation(kind, of_both, experiment.record, options, *selection)) {
    second.gain.reset();
    second.delay_s.reset();
    return {std::move(*worse)};
  }
  second.fitted = true;
  model.drive = fit.model;
  model.model_error = unexplained_difference(model.drive, m.response);
  return findings;
}

}  // namespace resonid::identification::detail
