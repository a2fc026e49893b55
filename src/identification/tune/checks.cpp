// SPDX-License-Identifier: MIT
#include "identification/tune/checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "design/figures.hpp"
#include "design/machine.hpp"
#include "identification/tune/law.hpp"
#include "identification/tune/response_only.hpp"

namespace resonid::identification {
namespace {

using Checked = expected<void, Error>;

std::string named(const Result& result) {
  return result.record.file.empty() ? "the result" : "the result of " + result.record.file;
}

Checked check_ranges(const TuneOptions& o) {
  const auto is_positive = [](const std::optional<double>& x) {
    return !x || (*x > 0.0 && std::isfinite(*x));
  };
  if (!(o.largest_sensitivity > 1.0 && std::isfinite(o.largest_sensitivity)))
    return refuse("largest_sensitivity", "must be > 1: no loop with a delay stays below",
                  o.largest_sensitivity);
  if (!(o.largest_load_transfer > 1.0))
    return refuse("largest_load_transfer", "must be > 1: it is 1 at standstill", o.largest_load_transfer);
  if (!(o.largest_position_transfer > 1.0 && std::isfinite(o.largest_position_transfer)))
    return refuse("largest_position_transfer", "must be > 1: it is 1 at standstill",
                  o.largest_position_transfer);
  if (o.largest_complementary && !(*o.largest_complementary > 1.0))
    return refuse("largest_complementary", "must be > 1: it is 1 at standstill", *o.largest_complementary);
  if (!is_positive(o.largest_controller_sensitivity))
    return refuse("largest_controller_sensitivity", "must be > 0", *o.largest_controller_sensitivity);
  if (!is_positive(o.least_bandwidth_hz))
    return refuse("least_bandwidth_hz", "must be > 0", *o.least_bandwidth_hz);
  if (!is_positive(o.torque_limit)) return refuse("torque_limit", "must be > 0", *o.torque_limit);
  if (!is_positive(o.largest_noise_torque))
    return refuse("largest_noise_torque", "must be > 0", *o.largest_noise_torque);
  if (!(o.reference_step > 0.0 && std::isfinite(o.reference_step)))
    return refuse("reference_step", "must be > 0", o.reference_step);
  if (!(o.overshoot >= 0.0 && o.overshoot < 1.0))
    return refuse("overshoot", "must be from 0 to below 1", o.overshoot);
  if (!(o.confidence > 0.0 && o.confidence < 1.0))
    return refuse("confidence", "must be between 0 and 1", o.confidence);
  if (o.delay_std_s && !(*o.delay_std_s >= 0.0 && std::isfinite(*o.delay_std_s)))
    return refuse("delay_std_s", "must be >= 0", *o.delay_std_s);
  if (o.biquads < 1 || o.biquads > 4)
    return refuse("biquads", "must be from 1 to 4", static_cast<double>(o.biquads));
  constexpr double kSeen = 20.0;  // draws that may exceed, so that their share is known
  if (const double least = std::max(100.0, kSeen / (1.0 - o.confidence));
      static_cast<double>(o.draws) < least)
    return refuse("draws", fmt::format("must be at least {:.0f} for this confidence", std::ceil(least)),
                  static_cast<double>(o.draws));
  if (o.evaluate && (o.least_bandwidth_hz || o.largest_noise_torque))
    return refuse("evaluate",
                  "is judged by bounds on |S|, |T|, |C S| and |T_load|; bandwidth and noise torque are "
                  "wishes of a design");
  if (!(o.shaper_limit > 0.0 && o.shaper_limit < 1.0))
    return refuse("shaper_limit", "must be between 0 and 1", o.shaper_limit);
  return {};
}

Checked check_positions(std::size_t results, const TuneOptions& o) {
  if (o.positions.empty() && o.largest_speed)
    return refuse("largest_speed", "must come with positions, over which gains are scheduled",
                  *o.largest_speed);
  if (o.positions.empty()) return {};
  if (o.largest_speed && !(*o.largest_speed > 0.0 && std::isfinite(*o.largest_speed)))
    return refuse("largest_speed", "must be > 0", *o.largest_speed);
  if (o.positions.size() != results)
    return refuse("positions", fmt::format("must be as many as there are results, {}", results),
                  static_cast<double>(o.positions.size()));
  if (results < 2) return refuse("positions", "need at least two results");
  if (o.structure != ControllerStructure::automatic && o.structure != ControllerStructure::pi)
    return refuse("structure", "must be pi: only its gains are scheduled");
  return {};
}

/// A model whose parameters are known exactly, or one by one alone, does not say what machine may be.
bool has_covariance(const fit::DriveModel& model) {
  bool related = false;
  int count = 0;
  for (int i = 0; i < fit::kParameterCount; ++i) {
    if (i == fit::kDelay ||
        !(fit::has_parameter(model.structure, i) || model.estimated[static_cast<std::size_t>(i)]))
      continue;
    if (!(model.covariance(i, i) > 0.0 && std::isfinite(model.covariance(i, i)))) return false;
    ++count;
    for (int j = 0; j < i; ++j) related = related || model.covariance(i, j) != 0.0;
  }
  return related || count == 1;
}

/// Limits of its torque are by the noise of each machine's own recording.
Checked check_noise(const Result& r, const TuneOptions& o) {
  if (!o.largest_noise_torque || (r.validation && r.validation->residual_rms)) return {};
  return refuse(
      "largest_noise_torque",
      fmt::format("needs the noise of the measured velocity, which {} does not tell: its model must "
                  "be fitted to the recording",
                  named(r)));
}

Checked check_result(const Result& r, const TuneOptions& o) {
  if (!r.model && is_response_only(r, o)) return {};
  if (!r.model)
    return refuse("results",
                  named(r) +
                      " holds no drive model, which this design needs; identify it with .model auto, "
                      "two-mass or rigid");
  const auto& drive = r.model->drive;
  if (!(drive.sample_time_s > 0.0)) return refuse("results", named(r) + " tells no sample time");
  if (!has_covariance(drive))
    return refuse("results", named(r) +
                                 " holds no covariance of its model: what a controller must withstand is not "
                                 "known; identify it anew");
  constexpr double kLongest = 500.0;  // samples: each is a state
  if (const double delay = drive.known_delay_s + drive.delay_s; delay > kLongest * drive.sample_time_s)
    return refuse("results", fmt::format("{} has a delay of {:.4g} ms: required {:g} samples at most",
                                         named(r), 1e3 * delay, kLongest));
  if (measured_band(r).high_hz <= 0.0)
    return refuse("results", named(r) +
                                 " holds no line of its response that is known to 30 %: the band in which "
                                 "the model was measured is not known");
  if (drive.output_filter_s < 0.0 || drive.torque_lag_s < 0.0)
    return refuse("results", named(r) + " has an unstable current loop: a lag below 0");
  // It is at rest wherever the integral part happens to be: a pole at 1 that nothing moves.
  if (drive.grounded())
    return refuse("results",
                  named(r) +
                      " is of a machine with a spring to the ground: no velocity loop with an integral part "
                      "brings it to rest at one place; it wants a position loop, which is not designed here");
  return {};
}

/// A controller that is given runs at the rate of the machine.
Checked check_step(const TuneOptions& options, double own) {
  if (!options.evaluate || options.evaluate->law) return {};
  const double step = options.evaluate->sample_time_s;
  if (step > 0.0 && std::abs(step / own - 1.0) > 0.01)
    return refuse("evaluate",
                  fmt::format("runs every {:g} s, the machine was sampled every {:g} s", step, own));
  return {};
}

}  // namespace

std::string end_of_lines_words(double last_hz, double may_be, const design::MachineEnd& end,
                               bool controller_grows) {
  const std::string why = end.is_sparse && !end.is_whole
                              ? "too few lines stand in the octave below it to tell of a resonance above"
                          : end.is_below_resonance() ? "the machine's response rises, or falls as before an "
                                                       "anti-resonance: a resonance stands above, which "
                                                       "may be many times higher"
                          : controller_grows
                              ? "the controller becomes larger above it"
                              : "a resonance above it may be twice as large as what an inertia does there";
  return fmt::format(
      "at the last line that is known, {:.3g} Hz, |L| must be at most {:g}, since {}; it may be {:.3g}. "
      "Excite up to where |L| stays below that{}, or lower the gains",
      last_hz, end.largest_loop(), why, may_be, controller_grows ? ", let the controller roll off" : "");
}

Checked check(std::span<const Result> results, const TuneOptions& options) {
  if (results.empty()) return refuse("results", "must be at least one");
  if (auto checked = check_ranges(options); !checked) return checked;
  if (auto checked = check_positions(results.size(), options); !checked) return checked;
  const Result& first = results.front();
  for (const Result& r : results) {
    if (auto checked = check_result(r, options); !checked) return checked;
    if (!r.model && results.size() > 1)
      return refuse("results", named(r) + " holds no drive model, as designs for several machines need");
    if (!r.model) return check_step(options, 1.0 / r.record.sample_rate_hz);
    if (auto checked = check_noise(r, options); !checked) return checked;
    const double step = r.model->drive.sample_time_s, first_step = first.model->drive.sample_time_s;
    constexpr double kSame = 1e-6;
    if (std::abs(step / first_step - 1.0) > kSame)
      return refuse("results",
                    fmt::format("{} was sampled every {:g} s, the first every {:g} s: one controller has one "
                                "sample time",
                                named(r), step, first_step));
    if (r.units.response != first.units.response)
      return refuse("results", fmt::format("{} is in {}, the first in {}: scales or units were given to one "
                                           "of them only",
                                           named(r), r.units.response, first.units.response));
  }
  return check_step(options, first.model->drive.sample_time_s);
}

std::string name_of_result(std::span<const Result> results, std::size_t i) {
  return results[i].record.file.empty() ? fmt::format("result {}", i + 1) : results[i].record.file;
}

std::string name_of_machine(std::span<const Result> results, std::size_t i) {
  return "the machine of " + name_of_result(results, i);
}

bool has_delay_std(const Result& result) {
  const auto& drive = result.model->drive;
  return drive.estimated[fit::kDelay] && drive.covariance(fit::kDelay, fit::kDelay) > 0.0;
}

double assumed_delay_std(const Result& result) { return 0.25 * result.model->drive.sample_time_s; }

std::size_t hold_of(const Result& result) {
  const auto told = std::ranges::find(result.findings, "held-output", &diagnostics::Finding::id);
  constexpr double kMost = 64.0;  // as identification looks for
  if (told == result.findings.end()) return 1;
  return static_cast<std::size_t>(std::lround(std::clamp(told->value.value_or(1.0), 1.0, kMost)));
}

double late_by(const Result& result) {
  return result.known_delay_s + 0.5 * static_cast<double>(hold_of(result) - 1) / result.record.sample_rate_hz;
}

fit::DriveModel machine_of(const Result& result) {
  fit::DriveModel drive = result.model->drive;
  drive.known_delay_s += 0.5 * static_cast<double>(hold_of(result) - 1) * drive.sample_time_s;
  return drive;
}

std::vector<design::Posterior> posteriors_of(std::span<const Result> results, const TuneOptions& options) {
  std::vector<design::Posterior> list;
  for (const Result& r : results) {
    fit::DriveModel drive = machine_of(r);
    // What is told overrules what was fitted.
    if (options.delay_std_s) {
      drive.covariance.row(fit::kDelay).setZero();
      drive.covariance.col(fit::kDelay).setZero();
    }
    list.emplace_back(std::move(drive), options.delay_std_s.value_or(assumed_delay_std(r)), known_to_hz(r));
  }
  return list;
}

MeasuredBand measured_band(const Result& result) {
  const auto& g = result.response;
  constexpr double kKnown = 0.3;
  std::size_t first = 0, last = g.lines();
  const auto is_noise = [&](std::size_t i) {
    return i < g.std.size() && !(g.std[i] < kKnown * std::abs(g.value[i]));
  };
  while (first < last && is_noise(first)) ++first;
  while (last > first && is_noise(last - 1)) --last;
  if (first == last) return {};
  return {g.frequency_hz[first], g.frequency_hz[last - 1]};
}

double known_to_hz(const Result& result) {
  const double high_hz = measured_band(result).high_hz;
  if (result.model->drive.structure != fit::Structure::rigid) return high_hz;
  // The least anti-resonance that may have escaped: it bends the response by (f/fa)^2 below.
  constexpr double kSeen = 3.0;  // standard deviations
  const auto& g = result.response;
  double compliance_hz = high_hz;
  const bool is_told = std::ranges::find(result.findings, "friction-in-response",
                                         &diagnostics::Finding::id) == result.findings.end();
  for (std::size_t i = 0; is_told && i < std::min(g.lines(), g.std.size()); ++i) {
    const double error = kSeen * g.std[i] / std::abs(g.value[i]);
    if (error > 0.0 && error < 1.0)
      compliance_hz = std::max(compliance_hz, g.frequency_hz[i] / std::sqrt(error));
  }
  return std::min(high_hz, compliance_hz / kCalmBelowCompliance);
}

double noise_torque_of(const design::LinearController& controller,
                       const std::vector<design::Machine>& machines, std::span<const Result> results) {
  double largest = 0.0;
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto& validation = results[i].validation;
    if (validation && validation->residual_rms)
      largest = std::max(largest, figures_of(machines[i], controller).noise_gain * *validation->residual_rms);
  }
  return largest;
}

Checked check_crossover(const TunedController& controller, const std::vector<design::Machine>& machines,
                        std::span<const Result> results) {
  // Below the band the inertia alone counts, which the lowest lines tell.
  constexpr double kBelow = 0.3;
  // The loop's size at the end of the band is bounded to a thousandth or two.
  constexpr double kReached = 1.003;
  const design::LinearController linear(controller.feedback);
  for (std::size_t i = 0; i < results.size(); ++i) {
    const auto band = measured_band(results[i]);
    const auto figures = figures_of(machines[i], linear);
    // Far below every line |L| is what it is at standstill: a loop that is small there too never crosses.
    constexpr double kFarBelow = 1e-7;
    const auto far_below = [&] {
      const std::array at = {kFarBelow * band.low_hz};
      return std::abs(design::LoopFunctions(machines[i].response(), linear).at(at).front().loop);
    };
    if (figures.crossings.empty() && !(far_below() < 1.0))
      return refuse("results",
                    fmt::format("{} was measured from {:.3g} to {:.3g} Hz, the loop would cross far below, "
                                "where nothing is known; excite lower frequencies too",
                                named(results[i]), band.low_hz, band.high_hz));
    for (const auto& crossing : figures.crossings) {
      if (crossing.frequency_hz >= kBelow * band.low_hz && crossing.frequency_hz <= kReached * band.high_hz)
        continue;
      const bool is_below = crossing.frequency_hz < band.low_hz;
      return refuse(
          "results",
          fmt::format("{} was measured from {:.3g} to {:.3g} Hz, the loop would cross at {:.3g} Hz, "
                      "where nothing is known; {}",
                      named(results[i]), band.low_hz, band.high_hz, crossing.frequency_hz,
                      is_below ? "excite lower frequencies too"
                               : "excite that band, or ask for less by .largest_sensitivity or "
                                 ".largest_controller_sensitivity"));
    }
  }
  return {};
}

}  // namespace resonid::identification
