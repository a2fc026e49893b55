// SPDX-License-Identifier: MIT
#include <algorithm>
#include <cmath>
#include <fit/black_box/black_box_signals.hpp>
#include <resonid/fit/detail/projected_input.hpp>

namespace resonid::fit::detail {
namespace {

std::vector<double> filtered(const std::vector<double>& signal, const NoiseModel& noise) {
  return noise.order() == 0 ? signal : whiten(signal, noise);
}

/// Running sum, one sample late unless the present sample acts at once.
std::vector<double> summed(const std::vector<double>& x, bool at_once) {
  std::vector<double> result(x.size());
  double sum = 0.0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (at_once) sum += x[k];
    result[k] = sum;
    if (!at_once) sum += x[k];
  }
  return result;
}

BlackBoxLayout layout_of(const BlackBoxConfig& config, bool in_loop) {
  BlackBoxLayout layout;
  layout.order = config.order - (config.integrator ? 1 : 0);
  layout.taps = (config.integrator ? 1 : 0) + (config.direct_term ? 1 : 0);
  layout.initial_state = config.initial_state;
  layout.integrator = config.integrator;
  // A constant torque makes a ramp behind an integrator, whose initial value is a constant.
  layout.constant = config.offset || (config.integrator && config.initial_state);
  layout.ramp = config.integrator && config.offset && !in_loop;
  if (in_loop) {
    layout.delay_samples = config.delay_samples;
    layout.controller = config.controller;
  }
  return layout;
}

bool usable(const std::vector<double>& x, std::size_t samples) {
  return x.size() == samples && std::all_of(x.begin(), x.end(), [](double v) { return std::isfinite(v); });
}

bool varies(const std::vector<double>& x) {
  return std::any_of(x.begin(), x.end(), [&](double v) { return v != x.front(); });
}

std::optional<Error> error_of(const data::Record& record, const BlackBoxConfig& config) {
  if (config.order < 1 || config.order > 20)
    return Error{"order", "must be 1 ... 20", static_cast<double>(config.order)};
  if (!(record.sample_rate_hz > 0.0)) return Error{"record", "needs a sample rate", record.sample_rate_hz};
  const auto samples = record.samples();
  if (samples < 50 + 4 * static_cast<std::size_t>(config.order) + config.delay_samples)
    return Error{"record", "needs at least 50 + 4 order + delay samples", static_cast<double>(samples)};
  if (config.predictor == Predictor::closed_loop) {
    if (!config.controller || config.controller->numerator.empty() ||
        config.controller->denominator.empty() || config.controller->denominator.front() == 0.0)
      return Error{
          "controller",
          "is needed by the closed-loop predictor, its denominator beginning with another number than 0"};
    if (config.direct_term && config.delay_samples == 0)
      return Error{"direct_term", "needs a delay of at least one sample in a loop"};
  }
  if (config.start.present() && config.start.output.size() > config.order)
    return Error{"start", "must have at most the model's order"};
  if (config.initial) {
    const auto& given = config.initial->denominator;
    if (given.empty() || given.front() == 0.0 || given.size() > static_cast<std::size_t>(config.order) + 1)
      return Error{"initial", "must have at most the model's order"};
  }
  return std::nullopt;
}

}  // namespace

BlackBoxSignals prepared(const Recorded& raw, const NoiseModel& noise, const BlackBoxConfig& config) {
  BlackBoxSignals s;
  s.output = filtered(raw.output, noise);
  s.unused = touched(raw.unused, noise);
  if (config.predictor == Predictor::closed_loop) {
    s.excitation = filtered(raw.excitation, noise);
    s.reference = filtered(raw.reference, noise);
    return s;
  }
  const auto input = [&](const std::vector<double>& u) {
    auto x = filtered(u, noise);
    if (config.integrator) x = summed(x, config.direct_term);
    x.resize(x.size() - config.delay_samples);
    return x;
  };
  s.input = input(raw.input);
  if (config.predictor == Predictor::joint) s.instrument = input(raw.projected);
  const auto late = static_cast<std::ptrdiff_t>(config.delay_samples);
  s.output.erase(s.output.begin(), s.output.begin() + late);
  if (!s.unused.empty()) s.unused.erase(s.unused.begin(), s.unused.begin() + late);
  return s;
}

expected<Recorded, Error> recorded(const data::Record& record, const BlackBoxConfig& config) {
  if (const auto error = error_of(record, config)) return unexpected(*error);
  const std::size_t n = record.samples();
  Recorded raw{record.input.samples, record.output.samples, {}, {}, {}, {}};
  if (!config.holdout.empty()) raw.unused.assign(n, false);
  for (const auto& [from, to] : config.holdout)
    for (std::size_t k = from; k < std::min(to, n); ++k) raw.unused[k] = true;
  if (!usable(raw.output, n) || !varies(raw.output))
    return refuse("record", "needs a finite output that varies");
  if (!usable(raw.input, n) || !varies(raw.input))
    return refuse("record", "needs a finite input of the output's length that varies");
  if (config.predictor == Predictor::open_loop) return raw;
  auto projected = projected_input(record);
  if (!projected) return unexpected(projected.error());
  raw.projected = std::move(*projected);
  const auto channel = [n](const data::Channel& c) {
    return c.present() ? c.samples : std::vector<double>(n, 0.0);
  };
  raw.excitation = channel(record.excitation);
  raw.reference = channel(record.reference);
  return raw;
}

std::unique_ptr<BlackBoxProblem> problem_of(const BlackBoxSignals& signals, const BlackBoxConfig& config) {
  const bool in_loop = config.predictor == Predictor::closed_loop;
  return in_loop ? closed_loop_problem(signals, layout_of(config, true))
                 : open_loop_problem(signals, layout_of(config, false));
}

}  // namespace resonid::fit::detail
